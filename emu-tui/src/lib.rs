//! Full-screen views. Each is a value and two functions without side effects: what a key makes of it, and what it looks
//! like on a screen of some size. `screen` joins one to a real terminal; `play` gives it keys from a text and prints the
//! last picture, so that everything here is tested, and shown in documents, without a terminal.
//!
//! ```text
//!   key.rs     keys, and their names in a text      style.rs   styles, with and without colours; writing into a picture
//!   screen.rs  the terminal, given back on every way out       key_script.rs   keys from a text
//!   flow.rs    a rung with power flow               panel/    switches, lamps, timers: a ladder program by hand
//!                                                   debugger/ code, registers, pins: a chip by hand
//! ```
#![forbid(unsafe_code)]

pub mod debugger;
mod error;
pub mod key;
pub mod key_script;
pub mod panel;
pub mod rung_picture;
pub mod screen;
pub mod style;

pub use error::TuiError;
pub use key::{ScreenKey, ScriptStep};
pub use ratatui_core::buffer::Buffer;
pub use ratatui_core::layout::Rect;
use std::time::Duration;
pub use style::ScreenStyle;

/// What a view wants after a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViewRequest {
    /// To go on.
    Continue,
    /// To leave.
    Quit,
}

/// A full-screen view.
pub trait ScreenView {
    /// What it looks like on a screen of this size.
    fn render(&self, area: Rect, look: ScreenStyle) -> Buffer;
    /// A key was pressed while the screen had this size.
    fn handle_key(&mut self, key: ScreenKey, area: Rect) -> ViewRequest;
    /// Time has passed on the wall clock. Does a bounded piece of work, so that keys are answered.
    fn advance_time(&mut self, time: Duration);
    /// True while time moves it.
    fn is_moving(&self) -> bool;
}
