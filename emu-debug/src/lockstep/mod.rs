//! Compares a machine with another simulator, instruction by instruction, up to the first difference.
//!
//! ```text
//!   mod.rs    the comparison                  pipe.rs   a program with commands in and text out
//!   s51.rs    s51 of uCsim, for the 8051      gpsim.rs  gpsim, for PIC16
//!   simavr.rs simavr, for AVR, by the remote protocol of gdb
//!   process.rs a process that ends with all its children
//! ```

pub mod gpsim;
pub mod pipe;
mod process;
pub mod s51;
pub mod simavr;

use std::collections::VecDeque;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use emu_core::chip::ChipFamily;
use emu_core::cpu::{Cpu, Probe, StopReason};

use crate::probes::dyn_probe;

/// The registers of a machine at an instruction boundary.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RegisterView {
    /// Machine cycles since the start, if the peer reports them.
    pub cycle: Option<u64>,
    /// Registers by their names in [`emu_core::chip::Chip::cpu_regs`], with the peer's values. PC is in the
    /// unit of the chip's addresses.
    pub regs: Vec<(&'static str, u32)>,
}

impl RegisterView {
    /// Returns the program counter.
    #[must_use]
    pub fn pc(&self) -> Option<u32> {
        self.regs.iter().find(|(name, _)| *name == "PC").map(|(_, value)| *value)
    }
}

/// The start parameters of a peer.
#[derive(Debug, Clone, Copy)]
pub struct PeerStart<'a> {
    /// Its program, by name or path.
    pub program: &'a Path,
    /// Its working folder.
    pub folder: &'a Path,
    /// The HEX file in that folder.
    pub hex: &'a str,
    /// The chip, by the name in this project.
    pub chip: &'a str,
    /// The stack pointer after reset, in memory; simavr begins at the end of RAM on all chips.
    pub sp: u32,
    /// The oscillator frequency in Hz.
    pub hz: u64,
    /// Oscillator clocks per machine cycle.
    pub clocks_per_cycle: u32,
    /// Maximum time for an answer.
    pub timeout: Duration,
    /// Set to end the run: a wait for the peer then fails with [`io::ErrorKind::Interrupted`].
    pub interrupt: &'a Arc<AtomicBool>,
}

/// A sleep that our machine has passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PassedSleep {
    /// The address where it continues, in the unit of the chip's addresses.
    pub pc: u32,
    /// Machine cycles from the start to the wake, in the peer's count.
    pub cycle: u64,
}

/// A simulator with the same program, at its start.
pub trait PeerSimulator {
    /// Executes an instruction and returns the registers after it.
    ///
    /// # Errors
    /// The simulator has ended, gives an unknown answer, or does not answer in time
    /// ([`io::ErrorKind::TimedOut`]).
    fn step(&mut self) -> io::Result<RegisterView>;

    /// Executes an instruction that puts our machine to sleep, passes the sleep, and returns the registers
    /// after it. A peer that wakes elsewhere or later returns its own location.
    ///
    /// # Errors
    /// As [`PeerSimulator::step`].
    fn pass_sleep(&mut self, nap: PassedSleep) -> io::Result<RegisterView>;
}

/// What is compared, and up to where.
#[derive(Debug, Clone, Default)]
pub struct CompareOptions {
    /// Registers that may differ.
    pub ignore: Vec<String>,
    /// Cycles may differ.
    pub ignore_cycles: bool,
    /// Machine cycle at which it ends.
    pub until: u64,
    /// Number of instructions after which it ends.
    pub max_steps: u64,
    /// Number of instructions kept for the message.
    pub kept_instructions: usize,
}

/// An instruction that both have executed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExecutedInstruction {
    /// Its program word.
    pub pc: u32,
    /// The machine cycle in which it began.
    pub cycle: u64,
    /// The interrupt that was entered directly after it.
    pub interrupt: Option<u8>,
}

/// How the comparison ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LockstepOutcome {
    /// No difference up to the end.
    Same {
        /// Why it ended here.
        end: LockstepEnd,
    },
    /// The first difference.
    Differs {
        /// Our registers before the instruction.
        before: RegisterView,
        /// Our registers after the instruction.
        ours: RegisterView,
        /// The peer's registers after the instruction.
        theirs: RegisterView,
        /// Names of the differing registers; `cycles` for cycles.
        differing_names: Vec<&'static str>,
        /// The interrupt that both enter nearby, at different instructions.
        shared_interrupt: Option<u8>,
    },
}

/// Why the comparison ended without a difference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LockstepEnd {
    /// [`CompareOptions::until`] or [`CompareOptions::max_steps`].
    Limit,
    /// [`PeerStart::interrupt`].
    Interrupted,
    /// Our machine has ended, or is at an illegal instruction.
    Stopped(StopReason),
}

/// The report of a comparison.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LockstepReport {
    /// How it ended.
    pub outcome: LockstepOutcome,
    /// Number of instructions compared.
    pub steps: u64,
    /// Our machine cycle at the end.
    pub cycle: u64,
    /// The last instructions; the differing one is at the end.
    pub last_instructions: VecDeque<ExecutedInstruction>,
    /// Number of sleeps with another length in the peer: the length is not compared, what follows is.
    pub sleeps_of_other_length: u64,
}

impl LockstepReport {
    /// Returns the report of a run that was interrupted before the peer started; `cycle` is ours.
    #[must_use]
    pub fn interrupted(cycle: u64) -> LockstepReport {
        let outcome = LockstepOutcome::Same { end: LockstepEnd::Interrupted };
        LockstepReport { outcome, steps: 0, cycle, last_instructions: VecDeque::new(), sleeps_of_other_length: 0 }
    }
}

/// The name of the cycle count in reports, and in the list of ignored registers.
pub const CYCLES_NAME: &str = "cycles";

/// Runs both until they differ, or to the end.
///
/// # Errors
/// As [`PeerSimulator::step`].
pub fn compare<C: Cpu>(
    cpu: &mut C,
    peer: &mut dyn PeerSimulator,
    options: &CompareOptions,
) -> io::Result<LockstepReport> {
    let (mut last, mut steps, mut other_sleeps) = (VecDeque::new(), 0, 0);
    // The cycle of this machine at which the cycle count of the peer is 0.
    let mut cycle_offset = cpu.cycle();
    loop {
        let report = |outcome, cycle, last| {
            Ok(LockstepReport { outcome, steps, cycle, last_instructions: last, sleeps_of_other_length: other_sleeps })
        };
        if cpu.cycle() >= options.until || steps >= options.max_steps {
            return report(LockstepOutcome::Same { end: LockstepEnd::Limit }, cpu.cycle(), last);
        }
        let (pc, cycle) = (cpu.pc(), cpu.cycle());
        let before = cpu.clone();
        let mut entered = InterruptEntryProbe(None);
        let executed = cpu.instructions();
        // A stall of the core before its next instruction (a memory that is being read) passes together with
        // it.
        let mut stall_cycles = 0;
        while cpu.instructions() == executed && entered.0.is_none() && cpu.cycle() < options.until {
            stall_cycles = cpu.cycle() - cycle;
            match cpu.step(&mut dyn_probe::probe_events(&mut entered)) {
                StopReason::Limit => {}
                stop => return report(LockstepOutcome::Same { end: LockstepEnd::Stopped(stop) }, cycle, last),
            }
        }
        let asleep = entered.0.is_none() && cpu.is_asleep();
        let answer = if asleep {
            if let Err(end) = pass_own_sleep(cpu, options.until, &mut entered) {
                return report(LockstepOutcome::Same { end }, cpu.cycle(), last);
            }
            let pc = cpu.chip().code_address(cpu.pc());
            peer.pass_sleep(PassedSleep { pc, cycle: cpu.cycle().wrapping_sub(cycle_offset) })
        } else {
            peer.step()
        };
        let answer = answer.and_then(|view| catch_up(cpu, peer, cycle_offset, view, stall_cycles, options));
        let theirs = match answer {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {
                return report(LockstepOutcome::Same { end: LockstepEnd::Interrupted }, cycle, last);
            }
            answer => answer?,
        };
        let mut what = differences(&own_view(cpu, &theirs, cycle_offset), &theirs, options);
        if !what.is_empty()
            && let Some(PeerMatch { cpu: further, interrupt: vector, cycle_offset: shift }) =
                match_peer_state(cpu, entered.0, &theirs, PeerClock { cycle_offset, asleep }, options)
        {
            (*cpu, entered.0, what) = (further, vector, Vec::new());
            other_sleeps += u64::from(shift != cycle_offset);
            cycle_offset = shift;
        }
        steps += 1;
        if last.len() >= options.kept_instructions.max(1) {
            last.pop_front();
        }
        last.push_back(ExecutedInstruction { pc, cycle, interrupt: entered.0 });
        if !what.is_empty() {
            let (before, ours) = (own_view(&before, &theirs, cycle_offset), own_view(cpu, &theirs, cycle_offset));
            let moment = find_shared_interrupt(cpu, entered.0, &theirs, peer);
            let outcome =
                LockstepOutcome::Differs { before, ours, theirs, differing_names: what, shared_interrupt: moment };
            return Ok(LockstepReport {
                outcome,
                steps,
                cycle: cpu.cycle(),
                last_instructions: last,
                sleeps_of_other_length: other_sleeps,
            });
        }
    }
}

/// Passes the sleep of the machine up to its next instruction, which may belong to an interrupt.
fn pass_own_sleep<C: Cpu>(cpu: &mut C, until: u64, entered: &mut InterruptEntryProbe) -> Result<(), LockstepEnd> {
    // There are no stimuli, so nothing wakes it.
    if cpu.clone().is_blocked_on_input() {
        return Err(LockstepEnd::Stopped(StopReason::Halted));
    }
    match cpu.run(until, &mut WakeProbe(entered)) {
        StopReason::Probe => Ok(()),
        StopReason::Limit => Err(LockstepEnd::Limit),
        stop => Err(LockstepEnd::Stopped(stop)),
    }
}

/// Stops before the first instruction, and records the interrupt that it belongs to.
struct WakeProbe<'a>(&'a mut InterruptEntryProbe);

impl Probe for WakeProbe<'_> {
    const INSN: bool = true;

    fn on_instruction(&mut self, _at: u64, _pc: u32) -> bool {
        true
    }

    fn on_interrupt(&mut self, at: u64, vector: u8) {
        self.0.on_interrupt(at, vector);
    }
}

/// How the peer's cycle count relates to ours.
#[derive(Debug, Clone, Copy)]
struct PeerClock {
    /// Our cycle when the peer's count is 0.
    cycle_offset: u64,
    /// Whether the machine has slept, so that the count may be different.
    asleep: bool,
}

/// Our machine in the state of the peer.
struct PeerMatch<C> {
    /// The machine.
    cpu: C,
    /// The interrupt that it entered, if any.
    interrupt: Option<u8>,
    /// Our cycle when the peer's count is 0.
    cycle_offset: u64,
}

/// Searches for the peer's state near a first difference. The peer may enter an interrupt together with the
/// instruction before it, with the first instruction of the service routine, or both; and after a sleep its
/// cycle count may be different. Returns our machine there, the interrupt, and our cycle when the peer's
/// count is 0.
fn match_peer_state<C: Cpu>(
    cpu: &C,
    interrupt: Option<u8>,
    theirs: &RegisterView,
    PeerClock { cycle_offset, asleep }: PeerClock,
    options: &CompareOptions,
) -> Option<PeerMatch<C>> {
    let fits = |cpu: &C| {
        let shift = theirs.cycle.filter(|_| asleep).map_or(cycle_offset, |cycle| cpu.cycle().wrapping_sub(cycle));
        differences(&own_view(cpu, theirs, shift), theirs, options).is_empty().then_some(shift)
    };
    let mut further = cpu.clone();
    if let Some(shift) = fits(&further) {
        return Some(PeerMatch { cpu: further, interrupt, cycle_offset: shift });
    }
    let mut entered = InterruptEntryProbe(interrupt);
    // The entry, unless it has already passed; then an instruction.
    for _ in 0..1 + u32::from(interrupt.is_none()) {
        if further.step(&mut dyn_probe::probe_events(&mut entered)) != StopReason::Limit || entered.0.is_none() {
            return None;
        }
        if let Some(shift) = fits(&further) {
            return Some(PeerMatch { cpu: further, interrupt: entered.0, cycle_offset: shift });
        }
    }
    None
}

/// Words that a PIC16 ignores after a read or write of its program memory (DS30292, 4.4 and 4.5).
const IGNORED_WORDS: u64 = 2;

/// Steps the peer over the words that a PIC16 has ignored in the `stall_cycles` cycles before its
/// instruction, if the peer executes them one by one. Returns the peer's view after them, or `view_before` if
/// the peer did not have to catch up.
fn catch_up<C: Cpu>(
    cpu: &C,
    peer: &mut dyn PeerSimulator,
    cycle_offset: u64,
    view_before: RegisterView,
    stall_cycles: u64,
    options: &CompareOptions,
) -> io::Result<RegisterView> {
    let mut theirs = view_before;
    if stall_cycles == 0 || cpu.chip().family != ChipFamily::Pic16 {
        return Ok(theirs);
    }
    for _ in 0..stall_cycles.min(IGNORED_WORDS) {
        let ours = own_view(cpu, &theirs, cycle_offset);
        let is_behind = theirs.cycle.zip(ours.cycle).is_some_and(|(theirs, ours)| theirs < ours);
        if !is_behind || differences(&ours, &theirs, options).is_empty() {
            break;
        }
        theirs = peer.step()?;
    }
    Ok(theirs)
}

/// Number of instructions within which the other machine must enter the interrupt too.
const MAX_INTERRUPT_DISTANCE: u32 = 16;

/// Returns the interrupt that one of the two has just entered and the other enters soon; `entered` is ours,
/// otherwise the peer entered it.
fn find_shared_interrupt<C: Cpu>(
    cpu: &C,
    entered: Option<u8>,
    theirs: &RegisterView,
    peer: &mut dyn PeerSimulator,
) -> Option<u8> {
    let (mut ours, mut found) = (cpu.clone(), InterruptEntryProbe(entered));
    for _ in 0..MAX_INTERRUPT_DISTANCE {
        if found.0.is_some() {
            break;
        }
        ours.step(&mut dyn_probe::probe_events(&mut found));
    }
    let vector = found.0?;
    let address = |cpu: &C| Some(cpu.chip().code_address(cpu.pc()));
    let first = address(&ours);
    ours.step(&mut ());
    // A peer may execute the first instruction together with the entry.
    let there = [first, address(&ours)];
    if entered.is_none() {
        return there.contains(&theirs.pc()).then_some(vector);
    }
    (0..MAX_INTERRUPT_DISTANCE).any(|_| peer.step().is_ok_and(|view| there.contains(&view.pc()))).then_some(vector)
}

/// Returns those of our registers that the peer reports.
fn own_view<C: Cpu>(cpu: &C, theirs: &RegisterView, cycle_offset: u64) -> RegisterView {
    let own = |name: &'static str| match name {
        "PC" => cpu.chip().code_address(cpu.pc()),
        _ => cpu.reg(name).unwrap_or(0),
    };
    RegisterView {
        cycle: theirs.cycle.map(|_| cpu.cycle().wrapping_sub(cycle_offset)),
        regs: theirs.regs.iter().map(|&(name, _)| (name, own(name))).collect(),
    }
}

/// Returns the names of differing registers that are not ignored.
fn differences(ours: &RegisterView, theirs: &RegisterView, options: &CompareOptions) -> Vec<&'static str> {
    let free = |name: &str| options.ignore.iter().any(|ignored| ignored.eq_ignore_ascii_case(name));
    let pairs = ours.regs.iter().zip(&theirs.regs).filter(|(ours, theirs)| ours.1 != theirs.1);
    let mut what: Vec<&'static str> = pairs.map(|(ours, _)| ours.0).filter(|name| !free(name)).collect();
    if ours.cycle != theirs.cycle && !options.ignore_cycles && !free(CYCLES_NAME) {
        what.push(CYCLES_NAME);
    }
    what
}

/// Records the interrupt that is entered.
struct InterruptEntryProbe(Option<u8>);

impl Probe for InterruptEntryProbe {
    fn on_interrupt(&mut self, _at: u64, vector: u8) {
        self.0 = Some(vector);
    }
}

/// Interval at which a wait for a peer checks for an interrupt of the run.
const INTERRUPT_POLL: Duration = Duration::from_millis(50);

/// Returns an error if the run is interrupted.
fn check_interrupt(interrupt: &AtomicBool) -> io::Result<()> {
    if interrupt.load(Ordering::Relaxed) { Err(io::ErrorKind::Interrupted.into()) } else { Ok(()) }
}

/// Shortens a peer's output for a message.
fn shorten(what: &str) -> String {
    const ROOM: usize = 300;
    let (brief, more) = (what.chars().take(ROOM).collect::<String>(), what.chars().nth(ROOM).is_some());
    if more { brief + ".." } else { brief }
}

/// Returns the error for an answer that is not understood.
pub(crate) fn invalid_answer(what: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, shorten(&what.into()))
}

/// Returns the error for a sleep that does not end in the peer.
pub(crate) fn endless_sleep(error: io::Error, nap: PassedSleep) -> io::Error {
    match error.kind() {
        io::ErrorKind::TimedOut => {
            let what = format!("it sleeps on where emu wakes, in cycle {}, at 0x{:04x} ({error})", nap.cycle, nap.pc);
            io::Error::new(io::ErrorKind::TimedOut, what)
        }
        _ => error,
    }
}

/// Returns the error for an answer that does not come in time.
pub(crate) fn timed_out(timeout: Duration, what: impl AsRef<str>) -> io::Error {
    let what = format!("no answer within {} s; {}", timeout.as_secs(), shorten(what.as_ref()));
    io::Error::new(io::ErrorKind::TimedOut, what)
}

/// Returns the error for a chip that a peer does not have.
pub(crate) fn unknown_chip(chip: &str) -> io::Error {
    io::Error::new(io::ErrorKind::Unsupported, chip)
}
