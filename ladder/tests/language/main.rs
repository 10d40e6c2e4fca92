//! All tests of the language, in one program: what they share stands in `common`.

mod check;
mod common;
mod corpus;
mod docs;
mod draw;
mod elements;
mod random;
mod read;
