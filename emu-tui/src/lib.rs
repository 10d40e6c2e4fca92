//! Full-screen views. A view is a value with two functions that have no side effects: one handles a key, the
//! other draws a picture of a given size. `screen` connects a view to a real terminal; `play_keys` executes a
//! key script and returns the last picture, so everything here can be tested and documented without a
//! terminal.
//!
//! ```text
//!   key.rs           keys, and key scripts           key_script.rs  plays key scripts without a terminal
//!   screen.rs        the terminal and signals        style.rs       styles, and drawing into a picture
//!   rung_picture.rs  a rung with its power flow      panel/         a ladder program with switches and lamps
//!                                                    debugger/      a chip with code, registers and pins
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

/// What a view requests after a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViewRequest {
    /// Continue.
    Continue,
    /// Leave the view.
    Quit,
}

/// A full-screen view.
pub trait ScreenView {
    /// Draws the view on a screen of this size.
    fn render(&self, area: Rect, look: ScreenStyle) -> Buffer;
    /// Handles a key that was pressed on a screen of this size.
    fn handle_key(&mut self, key: ScreenKey, area: Rect) -> ViewRequest;
    /// Lets time pass. The work per call is bounded, so that keys are handled in time.
    fn advance_time(&mut self, time: Duration);
    /// True while the view changes with time.
    fn is_moving(&self) -> bool;
}
