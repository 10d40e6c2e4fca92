//! Turns the flags of `emu run` into a plan for the chosen chip.

use emu_core::cpu::Cpu;
use emu_debug::stop_condition::StopCondition;
use emu_debug::{AddressRange, CycleClock, ProgramSource, RunEnd, RunPlan, RunResult, TimedDrive, time};

use super::{DEFAULT_LIMIT, RamChoice, RunArgs};
use crate::shared::fail::{VerbFailure, exit};
use crate::shared::machine;

/// The flags of `emu run`, resolved for the chosen chip.
pub struct PlannedRun {
    /// Converts times to cycles.
    pub clock: CycleClock,
    /// Limits and conditions of the run.
    pub plan: RunPlan,
    /// External drives of pins and supply, with their times.
    pub drives: Vec<TimedDrive>,
    /// Memory ranges to show at the end, with their text as typed.
    pub peek: Vec<(String, AddressRange)>,
}

/// Resolves the flags for the chip of `source`. Refuses values that make no sense on it.
pub fn plan_run(args: &RunArgs, source: &ProgramSource<'_>, clock: CycleClock) -> Result<PlannedRun, VerbFailure> {
    let names = &source.names;
    let time = args.time.as_deref().unwrap_or(DEFAULT_LIMIT);
    let limit = match args.cycles {
        Some(n) if n > time::MAX_CYCLES => {
            return Err(VerbFailure::invalid_flag_value("--cycles <N>", &n.to_string(), &"at most 2^62 cycles"));
        }
        Some(n) => n,
        None => clock.parse_cycles(time).map_err(|why| VerbFailure::invalid_flag_value("--for <TIME>", time, &why))?,
    };
    let drives = args.machine.drives(source, clock, &str::to_owned)?;
    let conditions = args
        .until
        .iter()
        .map(|t| source.parse_condition(t).map_err(|why| VerbFailure::invalid_flag_value("--until <COND>", t, &why)));
    let peek = args.peek.iter().map(|text| match names.parse_range(text) {
        Ok(range) => Ok((text.clone(), range)),
        Err(why) => Err(VerbFailure::invalid_flag_value("--peek <RANGE>", text, &why)),
    });
    let plan = RunPlan {
        limit,
        until: conditions.collect::<Result<_, _>>()?,
        expect: args.expect_uart.clone().map(|t| t.0),
        fail: args.fail_uart.clone().map(|t| t.0),
        stop_on_unwritten_read: matches!(args.ram, RamChoice::Trap),
        initialized: Vec::new(),
        continues: false,
        lint: args.lint.is_some(),
    };
    Ok(PlannedRun { clock, plan, drives, peek: peek.collect::<Result<_, _>>()? })
}

/// Refuses pins that the machine does not have because of its image.
pub fn check_pins_exist<C: Cpu>(planned: &PlannedRun, cpu: &C) -> Result<(), VerbFailure> {
    let awaited_pins = planned.plan.until.iter().filter_map(|until| match until {
        StopCondition::Pin(pin, _) => Some(*pin),
        _ => None,
    });
    machine::check_pins_exist(cpu, &planned.drives, awaited_pins)
}

/// Returns the text of --expect-uart if it was not sent.
pub fn missing_expected_text<'p>(plan: &'p RunPlan, result: &RunResult) -> Option<&'p [u8]> {
    let text = plan.expect.as_deref()?;
    (!text.is_empty() && !result.uart.windows(text.len()).any(|sent| sent == text)).then_some(text)
}

/// Returns the exit code. A condition of --until, or the end of a scenario, is success unless --expect-uart
/// still waits.
pub fn exit_code(plan: &RunPlan, result: &RunResult, limit_requested: bool) -> u8 {
    let still_waits = missing_expected_text(plan, result).is_some() || !plan.until.is_empty();
    match result.reason {
        RunEnd::Finished if missing_expected_text(plan, result).is_some() => exit::FAILED,
        RunEnd::Expected | RunEnd::Finished => exit::OK,
        RunEnd::Until(..) if plan.expect.is_none() => exit::OK,
        RunEnd::Until(..) | RunEnd::Failed => exit::FAILED,
        RunEnd::Halted if still_waits => exit::FAILED,
        RunEnd::Halted => exit::OK,
        RunEnd::Limit if limit_requested && !still_waits => exit::OK,
        RunEnd::Limit | RunEnd::StoppedWaiting | RunEnd::Interrupted => exit::LIMIT,
        RunEnd::Error(_) => exit::FAULT,
    }
}
