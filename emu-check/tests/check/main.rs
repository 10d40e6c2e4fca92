//! What a check finds and says, in one program; the tests with faulty compilers stand apart.

mod common;
mod complete;
mod contract;
mod corpus;
mod examples;
mod faults;
mod foreign;
mod fuzz;
mod paces;
mod pages;
mod periods;
mod peripherals;
mod random;
mod report;
mod waits;
