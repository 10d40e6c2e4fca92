//! Runs: the runner, its end conditions, and the controller that decides how far it goes.

pub mod run_controller;
mod runner;
pub mod stop_condition;

pub use runner::{
    ConnectedMachine, ExtraProbes, ReadMemory, RunEnd, RunPlan, RunProbe, RunResult, pin_levels, run, run_with_devices,
    run_with_probe, shown_pin_levels,
};
