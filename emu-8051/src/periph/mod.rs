//! The peripherals. Nothing ticks: a part is brought up to a cycle when somebody looks, and says when it acts next.
//!
//! Within a machine cycle (user's manual, "CPU timing", "Interrupts", "Port structures") the order is: pins take what was
//! written at the end of the cycle before (S1P1), timer 2 sets TF2 (S2P2), counters count (S3P1), pins are sampled and flags
//! set (S5P2), a program reads, and at the end writes (S6P2). So a part that is synced to a cycle has done everything up to
//! S5P2 of it, and what is written then acts from the next cycle on.

pub mod map;
pub mod ports;
pub mod serial;
pub mod timer;
pub mod timer2;
