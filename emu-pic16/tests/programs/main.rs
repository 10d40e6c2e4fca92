//! Programs as text on the whole machine: whole ones by what they do ([`cases`]), facts of the chip's page ([`facts`]), random ones
//! beside a model that goes clock by clock ([`irq`]).

mod cases;
mod facts;
mod irq;
mod model;
mod script;
