//! Converter, comparators and parallel slave port: cases from the data sheets as text, and random writes,
//! levels and sleeps compared with slow models that step clock by clock.

mod adc_model;
mod cases;
mod comparator_model;
mod psp_model;
mod script;
