//! All tests of the language in one binary; `common` holds the shared helpers.

mod check;
mod common;
mod corpus;
mod docs;
mod draw;
mod elements;
mod notations;
mod random;
mod read;
