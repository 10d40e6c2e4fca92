//! Programs as text on the whole machine: complete programs and their effects ([`cases`]), facts of the
//! chip's page ([`facts`]), random programs compared with a model that steps clock by clock ([`irq`]).

mod cases;
mod facts;
mod irq;
mod model;
mod script;
