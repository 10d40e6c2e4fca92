//! Compares the serial port with the user's manual: hand-computed cases as text, and a slow model that is
//! ticked.

mod cases;
mod model;
mod random;
