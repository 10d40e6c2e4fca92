//! The runner: until something that was waited for, a limit, the end of the program or its fault.

use emu_core::chip::Chip;
use emu_core::cpu::{Cpu, Fault, Probe, Stop};
use emu_core::pins::{Level, PinId};

use crate::board::Board;
use crate::close::{Access, Close, RamTrap, Watch};
use crate::closer::{Beside, Closer};
use crate::host::{Going, Host, Patience, SLICE, Watched};
use crate::lints::{Found, Lints};
use crate::place::Range;
use crate::time::Clock;
use crate::tools::Tools;
use crate::trace::{self, Look};
use crate::uart::Uart;
use crate::until::Until;
use crate::wave::Wave;

/// What ends a run.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// Machine cycle at which it ends at the latest.
    pub limit: u64,
    /// Conditions; any of them ends it.
    pub until: Vec<Until>,
    /// A text in the serial output that ends it well, unless the host still waits ([`Host::waits`]).
    pub expect: Option<Vec<u8>>,
    /// A text in the serial output that ends it badly.
    pub fail: Option<Vec<u8>>,
    /// A read of RAM that was not written before ends it as a fault.
    pub trap_ram: bool,
    /// Bytes of data memory that the image filled, which count as written.
    pub filled: Vec<Range>,
    /// The machine goes on in another run: what it has not sent to the end is left to that.
    pub goes_on: bool,
    /// What the program does that is seldom meant is collected.
    pub lint: bool,
}

/// Why a run ended. What the program did wrong goes before what was waited for, a text of [`Plan::fail`] before others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// [`Plan::limit`].
    Limit,
    /// The program has ended: nothing can wake the chip any more.
    Halted,
    /// A condition of [`Plan::until`], by position; with the access where it waited for one.
    Until(usize, Option<Access>),
    /// The text of [`Plan::expect`].
    Expected,
    /// The text of [`Plan::fail`].
    Failed,
    /// No instruction.
    Illegal {
        /// Program word address.
        pc: u32,
        /// The word there.
        word: u16,
    },
    /// The program did what cannot be carried out, or read what it had not written.
    Fault {
        /// Program word address.
        pc: u32,
        /// What it was.
        fault: Fault,
    },
    /// The host did not want to go on.
    Host,
    /// The host was told to end it.
    Interrupted,
    /// What the host had the machine for is over.
    Over,
}

/// How a run ended.
#[derive(Debug)]
pub struct Ended {
    /// Why.
    pub reason: Reason,
    /// What the chip sent over its first serial port.
    pub uart: Vec<u8>,
    /// Pins that chip and outside drove against each other, each with the first machine cycle of that.
    pub contention: Vec<(PinId, u64)>,
    /// What the program did that is seldom meant, with [`Plan::lint`].
    pub lints: Vec<Found>,
    /// Why the waveform could not be written, where one was to be.
    pub unwritten: Option<std::io::Error>,
}

/// Runs `cpu` as `plan` says. `wave` is written along and ended; `go_on` is called with all bytes sent so far before the
/// first cycle, every few million cycles and at the end, and its false ends the run.
pub fn run<C: Cpu>(cpu: &mut C, plan: &Plan, wave: Option<Wave>, go_on: &mut dyn FnMut(&[u8]) -> bool) -> Ended {
    let clock = Clock { hz: 1, clocks_per_cycle: cpu.clocks_per_cycle() };
    run_on(&mut Board::new(Vec::new(), clock), cpu, plan, wave, &mut Patience(go_on))
}

/// [`run`] with the devices of a board.
pub fn run_on<C: Cpu>(
    board: &mut Board,
    cpu: &mut C,
    plan: &Plan,
    wave: Option<Wave>,
    host: &mut dyn Host<C>,
) -> Ended {
    run_along((cpu, board), plan, wave, (&mut (), None), host)
}

/// A byte of a memory, by the memory's name and address: [`Cpu::peek`].
pub type Memory<'a> = &'a dyn Fn(&str, u32) -> Option<u8>;

/// A probe that a run takes along. Of its constants only [`Probe::INSN`], [`Probe::EVERY`] and
/// [`Probe::FLOW`] may be true.
pub trait Along: Probe {
    /// The run stands at a trap that the plan does not wait for, before the instruction at the program word `pc`, and goes on.
    fn passes(&mut self, memory: Memory<'_>, pc: u32) {
        let _ = (memory, pc);
    }
}

impl Along for () {}

/// [`run_on`] with a probe along, and with each instruction shown to `look`.
pub fn run_along<C: Cpu, A: Along>(
    (cpu, board): (&mut C, &mut Board),
    plan: &Plan,
    wave: Option<Wave>,
    (along, look): (&mut A, Option<&mut Look<'_>>),
    host: &mut dyn Host<C>,
) -> Ended {
    if plan.looks_closer() || look.is_some() {
        return run_closer((cpu, board), plan, wave, (along, look), host);
    }
    run_with((cpu, board), plan, wave, along, host)
}

/// The one loop of all runs that look at more than what is along.
fn run_closer<C: Cpu>(
    (cpu, board): (&mut C, &mut Board),
    plan: &Plan,
    wave: Option<Wave>,
    (along, look): (&mut dyn Beside, Option<&mut Look<'_>>),
    host: &mut dyn Host<C>,
) -> Ended {
    let (close, lints) = plan.close(cpu);
    let mut closer = Closer { close, lints, look, along };
    let ended = run_with((cpu, board), plan, wave, &mut closer, host);
    Ended { lints: closer.lints.map_or_else(Vec::new, Lints::found), ..ended }
}

/// What looks at a run, as its loop knows it.
trait Looks: Probe + Sized {
    /// [`Along::passes`].
    fn passes(&mut self, memory: Memory<'_>, pc: u32);
    /// What it has seen that ends the run.
    fn saw(&self, plan: &Plan) -> Option<Reason>;
    /// Runs the machine as [`Cpu::run`] does; it may also stop without being asked to, so that it is asked what it has seen.
    fn go<C: Cpu>(cpu: &mut C, until: u64, tools: &mut Tools<&mut Self>) -> Stop;
}

impl<A: Along> Looks for A {
    fn passes(&mut self, memory: Memory<'_>, pc: u32) {
        Along::passes(self, memory, pc);
    }

    fn saw(&self, _: &Plan) -> Option<Reason> {
        None
    }

    fn go<C: Cpu>(cpu: &mut C, until: u64, tools: &mut Tools<&mut Self>) -> Stop {
        cpu.run(until, tools)
    }
}

impl Looks for Closer<'_, '_> {
    fn passes(&mut self, memory: Memory<'_>, pc: u32) {
        self.along.passes(memory, pc);
    }

    fn saw(&self, plan: &Plan) -> Option<Reason> {
        // What cannot be written any more is no reason to run on.
        let failed = self.look.as_ref().is_some_and(|look| look.has_failed());
        plan.saw(&self.close).or(failed.then_some(Reason::Host))
    }

    fn go<C: Cpu>(cpu: &mut C, until: u64, tools: &mut Tools<&mut Self>) -> Stop {
        if tools.close.look.is_some() { trace::go(cpu, until, tools) } else { cpu.run(until, tools) }
    }
}

/// Levels of all pins of a chip, in the order of its pins.
pub fn levels<C: Cpu>(cpu: &C, chip: &Chip) -> Vec<Level> {
    (0..chip.pins.len() as PinId).map(|pin| cpu.level(pin)).collect()
}

/// The same, and none for pins that are not shown ([`Cpu::shown_pins`]).
pub fn shown<C: Cpu>(cpu: &C, chip: &Chip) -> Vec<Option<Level>> {
    let mut levels = vec![None; chip.pins.len()];
    for pin in cpu.shown_pins() {
        if let Some(shown) = levels.get_mut(usize::from(pin)) {
            *shown = Some(cpu.level(pin));
        }
    }
    levels
}

impl Plan {
    /// Every instruction and every access has to be looked at.
    fn looks_closer(&self) -> bool {
        let close = |until: &Until| matches!(until, Until::Read(_) | Until::Write(_) | Until::Fetch(_));
        self.trap_ram || self.lint || self.until.iter().any(close)
    }

    /// What looks at them.
    fn close<C: Cpu>(&self, cpu: &C) -> (Close, Option<Lints>) {
        let ram = RamTrap { at: &|addr| cpu.ram_at(addr), filled: &self.filled };
        let watches = self.watches().into_iter().map(|(_, watch)| watch).collect();
        let close = Close::new(cpu.chip(), watches, self.trap_ram.then_some(&ram));
        let close = close.with_fetches(self.fetches().into_iter().map(|(_, pc)| pc).collect());
        (close, self.lint.then(|| Lints::new(cpu.chip(), &ram)))
    }

    /// What it has seen that ends the run.
    fn saw(&self, close: &Close) -> Option<Reason> {
        let fault = close.fault.map(|(pc, fault)| Reason::Fault { pc, fault });
        let access = || close.seen.and_then(|a| Some(Reason::Until(self.watches().get(a.watch)?.0, Some(a))));
        let fetched = || close.fetched.and_then(|i| Some(Reason::Until(self.fetches().get(i)?.0, None)));
        fault.or_else(access).or_else(fetched)
    }

    fn watches(&self) -> Vec<(usize, Watch)> {
        let watch = |(i, until): (usize, &Until)| match until {
            Until::Read(range) => Some((i, Watch { range: *range, write: false })),
            Until::Write(range) => Some((i, Watch { range: *range, write: true })),
            _ => None,
        };
        self.until.iter().enumerate().filter_map(watch).collect()
    }

    /// Fetches that are waited for: condition and program word.
    fn fetches(&self) -> Vec<(usize, u32)> {
        let fetch = |(i, until): (usize, &Until)| match until {
            Until::Fetch(pc) => Some((i, *pc)),
            _ => None,
        };
        self.until.iter().enumerate().filter_map(fetch).collect()
    }

    /// The texts, and what each of them means.
    fn texts(&self) -> (Vec<Vec<u8>>, Vec<Reason>) {
        let fail = self.fail.iter().map(|text| (text.clone(), Reason::Failed));
        let expect = self.expect.iter().map(|text| (text.clone(), Reason::Expected));
        let until = self.until.iter().enumerate().filter_map(|(i, until)| match until {
            Until::Uart(text) => Some((text.clone(), Reason::Until(i, None))),
            _ => None,
        });
        fail.chain(expect).chain(until).unzip()
    }
}

fn run_with<C: Cpu, L: Looks>(
    (cpu, board): (&mut C, &mut Board),
    plan: &Plan,
    wave: Option<Wave>,
    close: &mut L,
    host: &mut dyn Host<C>,
) -> Ended {
    let (texts, meanings) = plan.texts();
    let (mut pins, mut pin_conditions) = (Vec::new(), Vec::new());
    for (i, until) in plan.until.iter().enumerate() {
        match until {
            Until::Pc(pc) => cpu.trap(*pc, true),
            Until::Line(_, words) => words.iter().for_each(|pc| cpu.trap(*pc, true)),
            Until::Pin(pin, level) => {
                pins.push((*pin, *level));
                pin_conditions.push(i);
            }
            Until::Fetch(_) | Until::Read(_) | Until::Write(_) | Until::Uart(_) => {}
        }
    }
    let here = pins.iter().position(|&(pin, level)| cpu.level(pin) == level);
    let mut tools = Tools {
        uart: Uart::new(texts),
        text: None,
        pins,
        pin: here,
        contention: Vec::new(),
        wave,
        close,
        watched: Watched::default(),
    };
    let seen = |tools: &Tools<&mut L>| {
        let text = tools.text.and_then(|i| meanings.get(i).copied());
        // What cannot be written any more is no reason to run on.
        let full = tools.wave.as_ref().is_some_and(Wave::has_failed).then_some(Reason::Host);
        let pin = || tools.pin.and_then(|i| pin_conditions.get(i)).map(|&i| Reason::Until(i, None));
        tools.close.saw(plan).or(text).or_else(pin).or(full)
    };
    let reason = loop {
        match seen(&tools) {
            Some(Reason::Expected) if host.waits() => tools.text = None,
            Some(reason) => break reason,
            None => {}
        }
        tools.watched.moved = false;
        let until = match host.going(cpu, &tools.uart.sent, &mut tools.watched) {
            Going::Until(cycle) => plan.limit.min(cycle).min(cpu.cycle().saturating_add(SLICE)),
            Going::Stop => break Reason::Host,
            Going::Over => {
                // What was done in the last moment is seen.
                board.run_by(cpu, cpu.cycle(), &mut tools, L::go);
                break Reason::Over;
            }
        };
        let stop = board.run_by(cpu, until, &mut tools, L::go);
        if let Some(reason) = seen(&tools).filter(|reason| *reason != Reason::Expected) {
            break reason;
        }
        match stop {
            Stop::Limit if cpu.cycle() >= plan.limit => break Reason::Limit,
            Stop::Limit | Stop::Probe => {}
            Stop::Halted => break Reason::Halted,
            Stop::Illegal { pc, word } => break Reason::Illegal { pc, word },
            Stop::Fault { pc, fault } => break Reason::Fault { pc, fault },
            Stop::Trap { pc } => {
                let here = |until: &Until| match until {
                    Until::Pc(word) => *word == pc,
                    Until::Line(_, words) => words.contains(&pc),
                    _ => false,
                };
                if let Some(i) = plan.until.iter().position(here) {
                    break Reason::Until(i, None);
                }
                tools.close.passes(&|space, addr| cpu.peek(space, addr), pc);
            }
        }
    };
    // The program was told that this byte is sent, and it will be.
    let last = cpu.stopping().filter(|_| !plan.goes_on).and_then(|byte| tools.uart.byte(byte));
    let reason = match last.and_then(|text| meanings.get(text)) {
        Some(Reason::Failed) if !matches!(reason, Reason::Illegal { .. } | Reason::Fault { .. }) => Reason::Failed,
        Some(&text) if matches!(reason, Reason::Limit | Reason::Halted | Reason::Until(..)) => text,
        _ => reason,
    };
    host.over(cpu, &tools.uart.sent);
    let unwritten = tools.wave.take().and_then(|wave| wave.finish(cpu.cycle()).err());
    Ended { reason, uart: tools.uart.sent, contention: tools.contention, lints: Vec::new(), unwritten }
}
