//! Where bits and modules are.
//!
//! Inputs are input channels; what lasts, and temporaries, are bits of M. An output that one ordinary coil writes in every scan is its
//! channel, and the machine keeps the image. Any other output is its image, which is also a bit of M and is brought to the channel when the
//! last rung is over: so a pin never shows a value that a later coil of the same scan overwrites.

use std::collections::{HashMap, HashSet};

use emu_ap101::config::{MODULES, ModuleKind, ModuleSettings, ModuleTimeUnit, OUTPUTS};
use emu_ap101::operands::{ZONE_BITS, ZONE_LETTERS};
use ladder::{CounterKind, TimerKind};

use crate::ir::{BitId, BitRole, Ir, IrOp, TimedModule, WordId, WordOperand};
use crate::map::CellLocation;
use crate::target::{BuildRefusal, CompileJob};

/// Bits of M that mean something to machines with several programs, and those that have no other meaning.
const FIRST_ORDINARY_BIT: u16 = 248;

/// The first image of an output in M.
const FIRST_OUTPUT_IMAGE: u16 = 256;

/// First addresses of the zones.
pub(super) const E_ZONE: u16 = zone('E');
/// See [`E_ZONE`].
pub(super) const R_ZONE: u16 = zone('R');
/// See [`E_ZONE`].
pub(super) const M_ZONE: u16 = zone('M');

/// Behind the address of a module: its running bit, which resets it.
pub(super) const RESET_OFFSET: u16 = MODULES as u16;

const fn zone(letter: char) -> u16 {
    let mut n = 0;
    while n < ZONE_LETTERS.len() && ZONE_LETTERS[n] != letter {
        n += 1;
    }
    n as u16 * ZONE_BITS
}

/// Where everything is. Addresses are those of instructions, eleven bits.
#[derive(Debug)]
pub(super) struct Ap101Layout {
    /// Of each bit cell.
    pub bits: Vec<u16>,
    /// Bits that nobody looks at between scans.
    pub temporary: HashSet<BitId>,
    /// Numbers of the modules of each word cell.
    pub words: Vec<u16>,
    /// Edge memories that modules need beside their own, by word.
    pub module_edge_bits: HashMap<WordId, u16>,
    /// A bit for values that an instruction is in the way of.
    pub scratch: u16,
    /// Outputs that are brought from their images at the end: image and channel.
    pub late_outputs: Vec<(u16, u16)>,
    /// Input channels up to the last one in use.
    pub inputs: u16,
    /// Output channels likewise.
    pub outputs: u16,
    /// How the modules are configured.
    pub modules: [ModuleSettings; MODULES],
    /// Bits of M in use, those of outputs not counted.
    pub memory_bits: u32,
}

/// Places of everything in `job`.
///
/// # Errors
/// More bits or modules than there are, with the figures.
pub(super) fn layout(job: &CompileJob<'_>) -> Result<Ap101Layout, Vec<BuildRefusal>> {
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

    let whole = used_modules(ir);
    let mut settings = [ModuleSettings::NONE; MODULES];
    let mut words = vec![0; ir.words.len()];
    for (number, (is, word, limit)) in (0..).zip(&whole) {
        if let Some(place) = words.get_mut(word.0 as usize) {
            *place = number;
        }
        if let Some(place) = settings.get_mut(usize::from(number)) {
            *place = module_settings(*is, *limit);
        }
    }
    if whole.len() > MODULES {
        let cause = format!("the program has {} timers and counters, the machine has {MODULES}", whole.len());
        refusals.push(BuildRefusal::Unsupported { cause, hint: "use fewer of them".to_owned(), element: None });
    }

    // Images of channels that are not in use are memory like any other.
    let mut free = (0..FIRST_ORDINARY_BIT).chain(FIRST_OUTPUT_IMAGE + outputs..FIRST_OUTPUT_IMAGE + OUTPUTS);
    let available = free.clone().count();
    let mut needed = 0;
    let mut give = || {
        needed += 1;
        M_ZONE + free.next().unwrap_or(0)
    };
    let (direct, mut late) = (directly_written_bits(ir), Vec::new());
    let mut bits = Vec::new();
    for (n, cell) in (0..).zip(&ir.bits) {
        bits.push(match cell.role {
            BitRole::Input => channel(&cell.name, false).unwrap_or(0),
            BitRole::Output => {
                let channel = channel(&cell.name, true).unwrap_or(0);
                if !direct.contains(&BitId(n)) {
                    late.push((M_ZONE + FIRST_OUTPUT_IMAGE + channel, E_ZONE + channel));
                }
                if direct.contains(&BitId(n)) { E_ZONE + channel } else { M_ZONE + FIRST_OUTPUT_IMAGE + channel }
            }
            BitRole::Relay | BitRole::Memory | BitRole::Temporary => give(),
        });
    }
    let own_edges = whole.iter().filter(|(is, ..)| needs_edge_memory(*is));
    let edges = own_edges.map(|(_, word, _)| (*word, give())).collect();
    let scratch = give();
    if needed > available {
        let cause = format!("relays and memories need {needed} bits of M, and {available} are free");
        let hint = "use fewer relays, edges and nested groups, or fewer output channels";
        refusals.push(BuildRefusal::Unsupported { cause, hint: hint.to_owned(), element: None });
    }
    if !refusals.is_empty() {
        return Err(refusals);
    }
    let temporary = (0..ir.bits.len() as u32).map(BitId).filter(|&bit| ir.is_temporary(bit)).collect();
    Ok(Ap101Layout {
        bits,
        temporary,
        words,
        module_edge_bits: edges,
        scratch,
        late_outputs: late,
        inputs,
        outputs,
        modules: settings,
        memory_bits: needed as u32,
    })
}

/// The place of a bit; of an output its image, which is written with the channel.
pub(super) fn bit_place(addr: u16) -> CellLocation {
    let (zone, offset) = (addr / ZONE_BITS * ZONE_BITS, addr % ZONE_BITS);
    let (space, offset) = match zone {
        E_ZONE => ("m", FIRST_OUTPUT_IMAGE + offset),
        M_ZONE => ("m", offset),
        _ => ("i", offset),
    };
    CellLocation::Bit { space: space.to_owned(), addr: offset.into(), bit: 0 }
}

/// The timers and counters, in order.
pub(super) fn used_modules(ir: &Ir) -> Vec<(TimedModule, WordId, WordOperand)> {
    let mut found = Vec::new();
    for_each_op(ir, &mut |op, _| {
        if let IrOp::Module { module: is, word, limit } = op {
            found.push((*is, *word, *limit));
        }
    });
    found
}

/// Calls `look` with every operation, and whether it is executed in every scan.
pub(super) fn for_each_op<'a>(ir: &'a Ir, look: &mut dyn FnMut(&'a IrOp, bool)) {
    let rungs = ir.rungs.iter().flat_map(|rung| &rung.steps).map(|step| &step.op);
    for op in ir.prologue.iter().chain(rungs).chain(&ir.epilogue) {
        let mut always = true;
        for_each_nested_op(op, &mut |op| look(op, std::mem::replace(&mut always, false)));
    }
}

/// Calls `look` with an operation and those within it.
pub(super) fn for_each_nested_op<'a>(op: &'a IrOp, look: &mut dyn FnMut(&'a IrOp)) {
    look(op);
    if let IrOp::If { if_true: then, if_false: otherwise, .. } = op {
        then.iter().chain(otherwise).for_each(|op| for_each_nested_op(op, look));
    }
}

/// The bit that an operation writes.
pub(super) fn written_bit(op: &IrOp) -> Option<BitId> {
    match op {
        IrOp::Store { bit, .. }
        | IrOp::SetBit { bit, .. }
        | IrOp::Rising(bit)
        | IrOp::Falling(bit)
        | IrOp::Logic { dst: bit, .. } => Some(*bit),
        _ => None,
    }
}

/// Bits that one operation alone writes, in every scan.
fn directly_written_bits(ir: &Ir) -> HashSet<BitId> {
    let mut writes: HashMap<BitId, (u32, bool)> = HashMap::new();
    for_each_op(ir, &mut |op, always| {
        if let Some(bit) = written_bit(op) {
            // An edge writes its memory bit by bit.
            let whole = always && !matches!(op, IrOp::Rising(_) | IrOp::Falling(_));
            let (count, all) = writes.entry(bit).or_insert((0, true));
            (*count, *all) = (*count + 1, *all && whole);
        }
    });
    writes.into_iter().filter(|(_, (count, whole))| *count == 1 && *whole).map(|(bit, _)| bit).collect()
}

/// It needs an edge memory of its own, because what it counts is not what is written to its module.
pub(super) fn needs_edge_memory(is: TimedModule) -> bool {
    matches!(is, TimedModule::Counter { input: '/' | '\\', .. }) && !writes_input_directly(is)
}

/// What the element gets is written to its module as it is.
pub(super) fn writes_input_directly(is: TimedModule) -> bool {
    match is {
        TimedModule::Timer(_) => true,
        TimedModule::Counter { kind, input, bounded } => input == '/' && (!bounded || kind == CounterKind::Ctc),
    }
}

/// The preset of a module: a bounded CTD gives n > max, and a module n >= preset.
pub(super) fn module_preset(is: TimedModule, limit: WordOperand) -> Option<i16> {
    let WordOperand::Const(limit) = limit else { return None };
    let below = matches!(is, TimedModule::Counter { kind: CounterKind::Ctd, bounded: true, .. });
    i16::try_from(limit.checked_add(i32::from(below))?).ok()
}

/// The module that is a timer or counter; `None` where there is none that does the same.
pub(super) fn module_kind(is: TimedModule) -> Option<ModuleKind> {
    match is {
        TimedModule::Timer(TimerKind::Ton) => Some(ModuleKind::Ton),
        TimedModule::Timer(TimerKind::Tof) => Some(ModuleKind::Tof),
        TimedModule::Timer(TimerKind::Rto) => Some(ModuleKind::Rto),
        TimedModule::Timer(TimerKind::Rtl | TimerKind::Tcy | TimerKind::Thi | TimerKind::Tlo) => None,
        TimedModule::Counter { kind: CounterKind::Ctu, .. } => Some(ModuleKind::Ctu),
        TimedModule::Counter { kind: CounterKind::Ctd, .. } => Some(ModuleKind::Ctd),
        // The circular module gives no carry.
        TimedModule::Counter { kind: CounterKind::Ctc, bounded, .. } => (!bounded).then_some(ModuleKind::Ctc),
        TimedModule::Counter { kind: CounterKind::Ctr, .. } => None,
    }
}

fn module_settings(is: TimedModule, limit: WordOperand) -> ModuleSettings {
    // What has no module or no preset was refused.
    let kind = module_kind(is).unwrap_or(ModuleKind::Ton);
    ModuleSettings { kind, unit: ModuleTimeUnit::Cycle, preset: module_preset(is, limit).unwrap_or(0) as u16 }
}
