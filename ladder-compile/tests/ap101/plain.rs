//! Programs of which the instructions are known.
