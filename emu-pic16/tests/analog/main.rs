//! Converter, comparators, parallel slave port: cases from the data sheets as text, and slow ticked models that random
//! writes, levels and sleeps must agree with.

mod adc_model;
mod cases;
mod comparator_model;
mod psp_model;
mod script;
