//! Text that users write and read: times, escapes, number formats, and the errors in it.

pub(crate) mod input_error;
pub mod number_formats;
pub mod text_escapes;
pub mod time;
