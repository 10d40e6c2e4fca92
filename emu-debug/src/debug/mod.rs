//! The debugger without a face: a machine that can be stopped, looked at, and run forwards and backwards. The command line, the gdb
//! server, the DAP server and the screen are four faces of one [`DebugSession`].
//!
//! ```text
//!   target.rs   any Cpu without its type         session.rs  running forwards: steps, points, limits
//!   place.rs    what has a value: Place          back.rs     running backwards: nearest snapshot, then replay
//!   scope.rs    names to places                  history.rs  snapshots and what was done from outside
//!   expr.rs     expressions over places          followed_machine.rs     a machine on its way through that history
//!   points.rs   breakpoints and watchpoints      breakpoint_probe.rs     the probe that sees what points wait for
//!   flow.rs     calls and returns                event_log.rs   what the chip has done, in words
//!   calls.rs    the calls that are not over      step_until.rs   running step by step
//!   c_objects.rs   variables and values of C        parse.rs    expressions out of their text
//!   c_type_queries.rs    questions about types of C      expression_value.rs   values: whole numbers, and those with a point
//!   breakpoint_locations.rs    where breakpoints of functions and lines lie
//!   values.rs   the value history, and variables of the user
//!   c_values.rs    those as text                    c_types.rs    types of C as text
//! ```
//!
//! **Positions.** The debugger stands between two instructions. A step ends behind an instruction or behind the entry of an
//! interrupt, and time that passes in sleep belongs to the step that ends it. So the positions of a run are the same however it was
//! reached, and n steps back followed by n steps forward come out where they began.
//!
//! **Going back** takes the nearest snapshot before the wanted position and runs a copy of it forwards again, with everything that
//! was done from outside put in at its own cycle. Nothing of a machine can run backwards, and nothing has to.

mod arithmetic;
mod backwards;
mod breakpoint_locations;
mod breakpoint_probe;
mod c_objects;
mod c_type_queries;
mod c_types;
mod c_values;
mod call_flow;
mod call_stack;
mod dyn_machine;
mod error;
mod event_log;
mod expression;
mod expression_place;
mod expression_value;
mod followed_machine;
mod history;
mod parse_expression;
mod parse_literals;
mod points;
mod scope;
mod session;
mod step_until;
mod values;

pub use backwards::PassedPosition;
pub use c_objects::{ObjectByteLocation, ObjectExpr};
pub use c_type_queries::CTypeRef as CKind;
pub use c_values::{PrintSettings, c_text, real_text};
pub use call_flow::{CallFlow, call_flow};
pub use call_stack::{CallFrame, CallStack};
pub use dyn_machine::{DynMachine, DynProbe, MachineWithDevices, ObserveLevel};
pub use error::DebugError;
pub use expression::{BinaryOperator, DebugExpression};
pub use expression_place::ExpressionPlace;
pub use expression_value::ExpressionValue;
pub use followed_machine::ProgramFollower;
pub use history::UserAction;
pub use points::{AccessKind, DebugPoint, DebugPoints, PointTrigger};
pub use scope::NameScope;
pub use session::{DebugSession, HaltReason, HaltResult, PointHit, RunGoal, SessionOptions};
pub use values::Values;
