//! Tests of the results and messages of checks, in one executable; tests with faulty compilers are separate.

mod common;
mod complete;
mod contract;
mod convert;
mod corpus;
mod examples;
mod faults;
mod foreign;
mod fuzz;
mod grid;
mod instruction_list;
mod paces;
mod pages;
mod periods;
mod peripherals;
mod random;
mod registers;
mod report;
mod small_programs;
mod waits;
