//! A machine beside a simulator of somebody else, instruction by instruction, up to the first difference.
//!
//! ```text
//!   mod.rs    the two side by side            pipe.rs   a program with commands in and text out
//!   s51.rs    s51 of uCsim, for the 8051      gpsim.rs  gpsim, for PIC16
//!   simavr.rs simavr, for AVR, by the remote protocol of gdb
//! ```

pub mod gpsim;
pub mod pipe;
pub mod s51;
pub mod simavr;

use std::collections::VecDeque;
use std::io;

use emu_core::cpu::{Cpu, Probe, Stop};

use crate::seer;

/// What a machine shows at an instruction boundary.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct View {
    /// Machine cycles since the start, where the peer tells them.
    pub cycle: Option<u64>,
    /// Registers by their names in [`emu_core::chip::Chip::cpu_regs`], as the peer gives them. PC is as the chip's addresses are
    /// written.
    pub regs: Vec<(&'static str, u32)>,
}

/// A simulator with the same program, at its start.
pub trait Peer {
    /// Executes an instruction and shows what has become of it.
    ///
    /// # Errors
    /// The simulator has ended, or says what cannot be understood.
    fn step(&mut self) -> io::Result<View>;
}

/// What is compared, and how far.
#[derive(Debug, Clone, Default)]
pub struct Terms {
    /// Registers that may differ.
    pub ignore: Vec<String>,
    /// Cycles may differ.
    pub cycles_free: bool,
    /// Machine cycle at which it ends.
    pub until: u64,
    /// Instructions after which it ends.
    pub steps: u64,
    /// Instructions that are kept for the message.
    pub last: usize,
}

/// An instruction that both have executed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Done {
    /// Its program word.
    pub pc: u32,
    /// The machine cycle in which it began.
    pub cycle: u64,
    /// The interrupt that was entered right behind it.
    pub interrupt: Option<u8>,
}

/// How it ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// No difference up to the end.
    Same {
        /// Why it ended here.
        end: End,
    },
    /// The first difference.
    Differs {
        /// Our registers before the instruction, and after it.
        before: View,
        /// See `before`.
        ours: View,
        /// The peer's after it.
        theirs: View,
        /// Names of what differs; `cycles` for those.
        what: Vec<&'static str>,
    },
}

/// Why nothing more is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// [`Terms::until`] or [`Terms::steps`].
    Limit,
    /// Our machine has ended, or what it stands at is no instruction.
    Stopped(Stop),
}

/// How a run side by side went.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Report {
    /// How it ended.
    pub outcome: Outcome,
    /// Instructions compared.
    pub steps: u64,
    /// Our machine cycle at the end.
    pub cycle: u64,
    /// The last instructions, the one that differs at the end.
    pub last: VecDeque<Done>,
}

/// The name under which cycles are told, and may be ignored.
pub const CYCLES: &str = "cycles";

/// Runs both until they differ, or to the end.
///
/// # Errors
/// As [`Peer::step`].
pub fn compare<C: Cpu>(cpu: &mut C, peer: &mut dyn Peer, terms: &Terms) -> io::Result<Report> {
    let (mut last, mut steps) = (VecDeque::new(), 0);
    let begun = cpu.cycle();
    let report = |outcome, steps, cycle, last| Ok(Report { outcome, steps, cycle, last });
    loop {
        if cpu.cycle() >= terms.until || steps >= terms.steps {
            return report(Outcome::Same { end: End::Limit }, steps, cpu.cycle(), last);
        }
        let (pc, cycle) = (cpu.pc(), cpu.cycle());
        let before = cpu.clone();
        let mut entered = Entered(None);
        let executed = cpu.instructions();
        // What keeps the core from its next instruction (a memory that is read, sleep) is passed along with it.
        while cpu.instructions() == executed && entered.0.is_none() && cpu.cycle() < terms.until {
            match cpu.step(&mut seer::events(&mut entered)) {
                Stop::Limit => {}
                stop => return report(Outcome::Same { end: End::Stopped(stop) }, steps, cycle, last),
            }
        }
        let theirs = peer.step()?;
        let look = |cpu: &C| view(cpu, &theirs, begun);
        let mut what = differences(&look(cpu), &theirs, terms);
        if !what.is_empty() && entered.0.is_none() {
            // The peer may enter an interrupt along with the instruction before it.
            let mut further = cpu.clone();
            if further.step(&mut seer::events(&mut entered)) == Stop::Limit && entered.0.is_some() {
                let rest = differences(&look(&further), &theirs, terms);
                if rest.is_empty() {
                    (*cpu, what) = (further, rest);
                }
            }
            if !what.is_empty() {
                entered.0 = None;
            }
        }
        steps += 1;
        if last.len() >= terms.last.max(1) {
            last.pop_front();
        }
        last.push_back(Done { pc, cycle, interrupt: entered.0 });
        if !what.is_empty() {
            let (before, ours) = (view(&before, &theirs, begun), look(cpu));
            return report(Outcome::Differs { before, ours, theirs, what }, steps, cpu.cycle(), last);
        }
    }
}

/// Our registers, those that the peer tells.
fn view<C: Cpu>(cpu: &C, theirs: &View, begun: u64) -> View {
    let own = |name: &'static str| match name {
        "PC" => cpu.chip().code_address(cpu.pc()),
        _ => cpu.reg(name).unwrap_or(0),
    };
    View {
        cycle: theirs.cycle.map(|_| cpu.cycle() - begun),
        regs: theirs.regs.iter().map(|&(name, _)| (name, own(name))).collect(),
    }
}

/// Names of what differs and may not.
fn differences(ours: &View, theirs: &View, terms: &Terms) -> Vec<&'static str> {
    let free = |name: &str| terms.ignore.iter().any(|ignored| ignored.eq_ignore_ascii_case(name));
    let pairs = ours.regs.iter().zip(&theirs.regs).filter(|(ours, theirs)| ours.1 != theirs.1);
    let mut what: Vec<&'static str> = pairs.map(|(ours, _)| ours.0).filter(|name| !free(name)).collect();
    if ours.cycle != theirs.cycle && !terms.cycles_free && !free(CYCLES) {
        what.push(CYCLES);
    }
    what
}

/// Notes the interrupt that is entered.
struct Entered(Option<u8>);

impl Probe for Entered {
    fn irq(&mut self, _at: u64, vector: u8) {
        self.0 = Some(vector);
    }
}

/// What cannot be understood of a peer.
pub(crate) fn odd(what: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what.into())
}
