//! Where bits and modules are.
//!
//! Inputs are input channels; what lasts, and temporaries, are bits of M. An output that one ordinary coil writes in every scan is its
//! channel, and the machine keeps the image. Any other output is its image, which is also a bit of M and is brought to the channel when the
//! last rung is over: so a pin never shows a value that a later coil of the same scan overwrites.

use std::collections::{HashMap, HashSet};

use emu_ap101::config::{Kind, MODULES, OUTPUTS, Settings, Unit};
use emu_ap101::operands::{ZONE, ZONES};
use ladder::{CounterKind, TimerKind};

use crate::ir::{Bit, BitRole, Ir, Module, Op, Value, Word};
use crate::map::Place;
use crate::target::{Job, Refusal};

/// Bits of M that mean something to machines with several programs, and those that have no other meaning.
const PLAIN: u16 = 248;

/// The first image of an output in M.
const IMAGE: u16 = 256;

/// First addresses of the zones.
pub(super) const E: u16 = zone('E');
/// See [`E`].
pub(super) const R: u16 = zone('R');
/// See [`E`].
pub(super) const M: u16 = zone('M');

/// Behind the address of a module: its running bit, which resets it.
pub(super) const RESET: u16 = MODULES as u16;

const fn zone(letter: char) -> u16 {
    let mut n = 0;
    while n < ZONES.len() && ZONES[n] != letter {
        n += 1;
    }
    n as u16 * ZONE
}

/// Where everything is. Addresses are those of instructions, eleven bits.
#[derive(Debug)]
pub(super) struct Layout {
    /// Of each bit cell.
    pub bits: Vec<u16>,
    /// Bits that nobody looks at between scans.
    pub temporary: HashSet<Bit>,
    /// Numbers of the modules of each word cell.
    pub words: Vec<u16>,
    /// Edge memories that modules need beside their own, by word.
    pub edges: HashMap<Word, u16>,
    /// A bit for values that an instruction is in the way of.
    pub scratch: u16,
    /// Outputs that are brought from their images at the end: image and channel.
    pub late: Vec<(u16, u16)>,
    /// Input channels up to the last one in use.
    pub inputs: u16,
    /// Output channels likewise.
    pub outputs: u16,
    /// How the modules are configured.
    pub modules: [Settings; MODULES],
    /// Bits of M in use, those of outputs not counted.
    pub memory: u32,
}

/// Places of everything in `job`.
///
/// # Errors
/// More bits or modules than there are, with the figures.
pub(super) fn layout(job: &Job<'_>) -> Result<Layout, Vec<Refusal>> {
    let ir = job.ir;
    let mut refusals = Vec::new();
    let channel = |name: &str, output: bool| {
        let pin = job.pins.iter().find(|pin| pin.name == name && pin.output == output)?;
        pin.pin.get(1..)?.parse::<u16>().ok()
    };
    let channels = |output: bool, role: BitRole| {
        let used = ir.bits.iter().filter(|cell| cell.role == role).filter_map(|cell| channel(&cell.name, output));
        used.max().map_or(0, |last| last + 1)
    };
    let (inputs, outputs) = (channels(false, BitRole::Input), channels(true, BitRole::Output));

    let whole = modules(ir);
    let mut settings = [Settings::NONE; MODULES];
    let mut words = vec![0; ir.words.len()];
    for (number, (is, word, limit)) in (0..).zip(&whole) {
        if let Some(place) = words.get_mut(word.0 as usize) {
            *place = number;
        }
        if let Some(place) = settings.get_mut(usize::from(number)) {
            *place = configured(*is, *limit);
        }
    }
    if whole.len() > MODULES {
        let cause = format!("the program has {} timers and counters, the machine has {MODULES}", whole.len());
        refusals.push(Refusal::Lacks { cause, hint: "use fewer of them".to_owned(), element: None });
    }

    // Images of channels that are not in use are memory like any other.
    let mut free = (0..PLAIN).chain(IMAGE + outputs..IMAGE + OUTPUTS);
    let available = free.clone().count();
    let mut needed = 0;
    let mut give = || {
        needed += 1;
        M + free.next().unwrap_or(0)
    };
    let (direct, mut late) = (direct(ir), Vec::new());
    let mut bits = Vec::new();
    for (n, cell) in (0..).zip(&ir.bits) {
        bits.push(match cell.role {
            BitRole::Input => channel(&cell.name, false).unwrap_or(0),
            BitRole::Output => {
                let channel = channel(&cell.name, true).unwrap_or(0);
                if !direct.contains(&Bit(n)) {
                    late.push((M + IMAGE + channel, E + channel));
                }
                if direct.contains(&Bit(n)) { E + channel } else { M + IMAGE + channel }
            }
            BitRole::Relay | BitRole::Memory | BitRole::Temporary => give(),
        });
    }
    let own_edges = whole.iter().filter(|(is, ..)| keeps_edge(*is));
    let edges = own_edges.map(|(_, word, _)| (*word, give())).collect();
    let scratch = give();
    if needed > available {
        let cause = format!("relays and memories need {needed} bits of M, and {available} are free");
        let hint = "use fewer relays, edges and nested groups, or fewer output channels";
        refusals.push(Refusal::Lacks { cause, hint: hint.to_owned(), element: None });
    }
    if !refusals.is_empty() {
        return Err(refusals);
    }
    let temporary = (0..ir.bits.len() as u32).map(Bit).filter(|&bit| ir.is_temporary(bit)).collect();
    Ok(Layout {
        bits,
        temporary,
        words,
        edges,
        scratch,
        late,
        inputs,
        outputs,
        modules: settings,
        memory: needed as u32,
    })
}

/// The place of a bit; of an output its image, which is written with the channel.
pub(super) fn place(addr: u16) -> Place {
    let (zone, offset) = (addr / ZONE * ZONE, addr % ZONE);
    let (space, offset) = match zone {
        E => ("m", IMAGE + offset),
        M => ("m", offset),
        _ => ("i", offset),
    };
    Place::Bit { space: space.to_owned(), addr: offset.into(), bit: 0 }
}

/// The timers and counters, in order.
pub(super) fn modules(ir: &Ir) -> Vec<(Module, Word, Value)> {
    let mut found = Vec::new();
    every(ir, &mut |op, _| {
        if let Op::Module { is, word, limit } = op {
            found.push((*is, *word, *limit));
        }
    });
    found
}

/// Calls `look` with every operation, and whether it is executed in every scan.
pub(super) fn every<'a>(ir: &'a Ir, look: &mut dyn FnMut(&'a Op, bool)) {
    let rungs = ir.rungs.iter().flat_map(|rung| &rung.steps).map(|step| &step.op);
    for op in ir.begin.iter().chain(rungs).chain(&ir.end) {
        let mut always = true;
        each(op, &mut |op| look(op, std::mem::replace(&mut always, false)));
    }
}

/// Calls `look` with an operation and those within it.
pub(super) fn each<'a>(op: &'a Op, look: &mut dyn FnMut(&'a Op)) {
    look(op);
    if let Op::If { then, otherwise, .. } = op {
        then.iter().chain(otherwise).for_each(|op| each(op, look));
    }
}

/// The bit that an operation writes.
pub(super) fn written(op: &Op) -> Option<Bit> {
    match op {
        Op::Store { bit, .. }
        | Op::Put { bit, .. }
        | Op::Rising(bit)
        | Op::Falling(bit)
        | Op::Logic { dst: bit, .. } => Some(*bit),
        _ => None,
    }
}

/// Bits that one operation alone writes, in every scan.
fn direct(ir: &Ir) -> HashSet<Bit> {
    let mut writes: HashMap<Bit, (u32, bool)> = HashMap::new();
    every(ir, &mut |op, always| {
        if let Some(bit) = written(op) {
            // An edge writes its memory bit by bit.
            let whole = always && !matches!(op, Op::Rising(_) | Op::Falling(_));
            let (count, all) = writes.entry(bit).or_insert((0, true));
            (*count, *all) = (*count + 1, *all && whole);
        }
    });
    writes.into_iter().filter(|(_, (count, whole))| *count == 1 && *whole).map(|(bit, _)| bit).collect()
}

/// It needs an edge memory of its own, because what it counts is not what is written to its module.
pub(super) fn keeps_edge(is: Module) -> bool {
    matches!(is, Module::Counter { input: '/' | '\\', .. }) && !is_plain(is)
}

/// What the element gets is written to its module as it is.
pub(super) fn is_plain(is: Module) -> bool {
    match is {
        Module::Timer(_) => true,
        Module::Counter { kind, input, bounded } => input == '/' && (!bounded || kind == CounterKind::Ctc),
    }
}

/// The preset of a module: a bounded CTD gives n > max, and a module n >= preset.
pub(super) fn preset(is: Module, limit: Value) -> Option<i16> {
    let Value::Const(limit) = limit else { return None };
    let below = matches!(is, Module::Counter { kind: CounterKind::Ctd, bounded: true, .. });
    i16::try_from(limit.checked_add(i32::from(below))?).ok()
}

fn configured(is: Module, limit: Value) -> Settings {
    let kind = match is {
        Module::Timer(TimerKind::Ton) => Kind::Ton,
        Module::Timer(TimerKind::Tof) => Kind::Tof,
        Module::Timer(TimerKind::Rto) => Kind::Rto,
        Module::Counter { kind: CounterKind::Ctu, .. } => Kind::Ctu,
        Module::Counter { kind: CounterKind::Ctd, .. } => Kind::Ctd,
        Module::Counter { kind: CounterKind::Ctc, .. } => Kind::Ctc,
    };
    // What has no preset was refused.
    Settings { kind, unit: Unit::Cycle, preset: preset(is, limit).unwrap_or(0) as u16 }
}
