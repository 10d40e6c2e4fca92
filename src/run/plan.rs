//! What the flags of `emu run` come to on the chosen chip.

use emu_core::cpu::Cpu;
use emu_debug::until::Until;
use emu_debug::{Clock, Drive, Ended, Plan, Range, Reason, Source, time};

use super::{DEFAULT_LIMIT, Ram, RunArgs};
use crate::fail::{Failure, exit};
use crate::machine;

/// What the flags come to on the chosen chip.
pub struct Planned {
    pub clock: Clock,
    pub plan: Plan,
    pub drives: Vec<Drive>,
    pub peek: Vec<(String, Range)>,
}

pub fn planned(args: &RunArgs, source: &Source<'_>, clock: Clock) -> Result<Planned, Failure> {
    let names = &source.names;
    let time = args.time.as_deref().unwrap_or(DEFAULT_LIMIT);
    let limit = match args.cycles {
        Some(n) if n > time::MAX_CYCLES => {
            return Err(Failure::value("--cycles <N>", &n.to_string(), "at most 2^62 cycles"));
        }
        Some(n) => n,
        None => clock.cycles(time).map_err(|why| Failure::value("--for <TIME>", time, &why))?,
    };
    let drives = args.machine.drives(source, clock, &str::to_owned)?;
    let conditions =
        args.until.iter().map(|t| source.until(t).map_err(|why| Failure::value("--until <COND>", t, &why)));
    let peek = args.peek.iter().map(|text| match names.range(text) {
        Ok(range) => Ok((text.clone(), range)),
        Err(why) => Err(Failure::value("--peek <RANGE>", text, &why)),
    });
    let plan = Plan {
        limit,
        until: conditions.collect::<Result<_, _>>()?,
        expect: args.expect_uart.clone().map(|t| t.0),
        fail: args.fail_uart.clone().map(|t| t.0),
        trap_ram: matches!(args.ram, Ram::Trap),
        filled: Vec::new(),
        goes_on: false,
        lint: args.lint.is_some(),
    };
    Ok(Planned { clock, plan, drives, peek: peek.collect::<Result<_, _>>()? })
}

/// Refuses pins that the machine does not have because its image says so.
pub fn there<C: Cpu>(job: &Planned, cpu: &C) -> Result<(), Failure> {
    let awaited = job.plan.until.iter().filter_map(|until| match until {
        Until::Pin(pin, _) => Some(*pin),
        _ => None,
    });
    machine::there(cpu, &job.drives, awaited)
}

/// The text of --expect-uart, where it has not come.
pub fn missing<'p>(plan: &'p Plan, ended: &Ended) -> Option<&'p [u8]> {
    let text = plan.expect.as_deref()?;
    (!text.is_empty() && !ended.uart.windows(text.len()).any(|sent| sent == text)).then_some(text)
}

/// The exit code: a condition of --until, or the end of a scenario, ends the run well unless --expect-uart still waits.
pub fn code(plan: &Plan, ended: &Ended, asked: bool) -> u8 {
    let waits = missing(plan, ended).is_some() || !plan.until.is_empty();
    match ended.reason {
        Reason::Over if missing(plan, ended).is_some() => exit::FAILED,
        Reason::Expected | Reason::Over => exit::OK,
        Reason::Until(..) if plan.expect.is_none() => exit::OK,
        Reason::Until(..) | Reason::Failed => exit::FAILED,
        Reason::Halted if waits => exit::FAILED,
        Reason::Halted => exit::OK,
        Reason::Limit if asked && !waits => exit::OK,
        Reason::Limit | Reason::Host | Reason::Interrupted => exit::LIMIT,
        Reason::Illegal { .. } | Reason::Fault { .. } => exit::FAULT,
    }
}
