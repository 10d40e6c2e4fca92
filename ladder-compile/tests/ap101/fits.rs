//! What does not fit, or is not there, is refused with the figures.
