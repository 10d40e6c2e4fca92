//! The debugger core: a machine that can be stopped, inspected, and run forwards and backwards. The command
//! line, the gdb server, the DAP server and the screen are four front ends of one [`DebugSession`].
//!
//! ```text
//!   dyn_machine.rs                 any Cpu as a trait object
//!   session.rs                     running forwards: steps, points, limits
//!   session_stop.rs                why the session stopped the machine
//!   step_until.rs                  running step by step
//!   backwards.rs                   running backwards: nearest copy, then replay
//!   history.rs                     copies of the machine, user actions
//!   machine_with_follower.rs       a machine with its follower
//!   points.rs                      breakpoints and watchpoints
//!   watchpoint_probe.rs            observes what watchpoints wait for
//!   breakpoint_locations.rs        breakpoints on functions and source lines
//!   event_log.rs                   the events of the chip
//!   call_flow.rs, call_stack.rs    calls and returns, the active calls
//!   scope.rs                       names to locations
//!   parse_expression.rs            text to expressions
//!   expression.rs                  expressions over locations
//!   expression_place.rs            locations that have a value
//!   expression_value.rs            values of expressions
//!   values.rs                      the value history, user variables
//!   c_objects.rs, c_values.rs      variables and values of C, as text
//!   c_strings.rs                   strings of C, as text
//!   c_types.rs, c_type_queries.rs  types of C, as text
//!   line_positions.rs              where steps by source lines end
//!   declarations.rs                what a program of C declares, by files
//! ```
//!
//! **Positions.** The debugger stops between two instructions. A step ends after an instruction or after the
//! entry of an interrupt; time that passes in sleep belongs to the step that ends it. So the positions of a
//! run do not depend on how they were reached, and n steps back followed by n steps forward return to the
//! start.
//!
//! **Going back** takes the nearest copy before the wanted position and runs it forwards again, with all user
//! actions applied at their own cycles. No part of a machine can run backwards, and none has to.

mod arithmetic;
mod backwards;
mod breakpoint_locations;
mod c_objects;
mod c_strings;
mod c_type_queries;
mod c_types;
mod c_values;
mod call_flow;
mod call_stack;
mod declarations;
mod dyn_machine;
mod error;
mod event_log;
mod expression;
mod expression_place;
mod expression_value;
mod history;
mod line_positions;
mod machine_with_follower;
mod parse_expression;
mod parse_literals;
mod points;
mod scope;
mod session;
mod session_stop;
mod step_until;
mod values;
mod watchpoint_probe;

pub use backwards::{EarlierHit, PassedPosition};
pub use c_objects::{ObjectByteLocation, ObjectExpr};
pub use c_strings::c_text;
pub use c_type_queries::CTypeRef;
pub use c_values::{NamedObject, PrintSettings, ValueAtCall, real_text};
pub use call_flow::{CallFlow, InstructionFlow, call_flow};
pub use call_stack::{CallFrame, CallStack, FrameName, NamedFunction};
pub use declarations::{Declaration, DeclarationKind};
pub use dyn_machine::{DynMachine, DynProbe, MachineWithDevices, ObserveLevel};
pub use error::DebugError;
pub use expression::{BinaryOperator, DebugExpression};
pub use expression_place::ExpressionPlace;
pub use expression_value::ExpressionValue;
pub use history::{HistorySize, UserAction};
pub use line_positions::{FileLine, LineOrigin, LinePosition, StepVerdict};
pub use machine_with_follower::ProgramFollower;
pub use points::{AccessKind, CallEnd, DebugPoint, DebugPoints, PointTrigger};
pub use scope::{NameScope, WatchedRange};
pub use session::{DebugSession, RunGoal, SessionOptions, TimedAction};
pub use session_stop::{PointHit, SessionStopReason};
pub use values::RememberedValues;
