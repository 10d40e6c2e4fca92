//! The debugger without a face: a machine that can be stopped, looked at, and run forwards and backwards. The command line, the gdb
//! server, the DAP server and the screen are four faces of one [`Session`].
//!
//! ```text
//!   target.rs   any Cpu without its type         session.rs  running forwards: steps, points, limits
//!   place.rs    what has a value: Place          back.rs     running backwards: nearest snapshot, then replay
//!   scope.rs    names to places                  history.rs  snapshots and what was done from outside
//!   expr.rs     expressions over places          line.rs     a machine on its way through that history
//!   points.rs   breakpoints and watchpoints      eyes.rs     the probe that sees what points wait for
//!   flow.rs     calls and returns                events.rs   what the chip has done, in words
//!   calls.rs    the calls that are not over      stroll.rs   running step by step
//!   object.rs   variables and values of C        parse.rs    expressions out of their text
//!   kinds.rs    questions about types of C      amount.rs   values: whole numbers, and those with a point
//!   spots.rs    where breakpoints of functions and lines lie
//!   ctext.rs    those as text                    ctype.rs    types of C as text
//! ```
//!
//! **Positions.** The debugger stands between two instructions. A step ends behind an instruction or behind the entry of an
//! interrupt, and time that passes in sleep belongs to the step that ends it. So the positions of a run are the same however it was
//! reached, and n steps back followed by n steps forward come out where they began.
//!
//! **Going back** takes the nearest snapshot before the wanted position and runs a copy of it forwards again, with everything that
//! was done from outside put in at its own cycle. Nothing of a machine can run backwards, and nothing has to.

mod amount;
mod back;
mod calls;
mod ctext;
mod ctype;
mod events;
mod expr;
mod eyes;
mod flow;
mod history;
mod kinds;
mod line;
mod object;
mod parse;
mod place;
mod points;
mod scope;
mod session;
mod spots;
mod stroll;
mod target;

pub use amount::Amount;
pub use back::Passed;
pub use calls::{CallFrame, CallStack};
pub use expr::{Expr, Operator};
pub use flow::{Flow, flow};
pub use history::Action;
pub use kinds::Kind as CKind;
pub use line::Follow;
pub use object::{Cell, ObjectExpr};
pub use place::Place;
pub use points::{Access, Point, Points, What};
pub use scope::Scope;
pub use session::{Goal, Halt, Hit, Options, Session, Why};
pub use target::{Look, Rig, Seer, Target};
