//! Assigns addresses to bits, and timers and counters to modules.
//!
//! Inputs are input channels; lasting and temporary bits are bits of M. An output that one ordinary coil
//! writes in every scan is placed directly at its channel, and the machine keeps the image. Any other output
//! is placed at its image, which is also a bit of M, and is copied to the channel after the last rung. So a
//! pin never shows a value that a later coil of the same scan overwrites.

use std::collections::{HashMap, HashSet};

use emu_ap101::config::{MODULES, ModuleKind, ModuleSettings, ModuleTimeUnit, OUTPUTS};
use emu_ap101::operands::{ZONE_BITS, ZONE_LETTERS};
use ladder::{CounterKind, TimerKind};

use crate::ir::{BitId, BitRole, Ir, IrOp, TimedModule, WordId, WordOperand};
use crate::map::CellLocation;
use crate::target::{BuildRefusal, CompileJob};

/// End of the ordinary bits of M: bits 248 to 255 enable the programs of a machine with several of them.
const FIRST_ORDINARY_BIT: u16 = 248;

/// First output image in M.
const FIRST_OUTPUT_IMAGE: u16 = 256;

/// First address of the E zone (output channels).
pub(super) const E_ZONE: u16 = zone('E');
/// First address of the R zone (modules); see [`E_ZONE`].
pub(super) const R_ZONE: u16 = zone('R');
/// First address of the M zone (memory bits); see [`E_ZONE`].
pub(super) const M_ZONE: u16 = zone('M');

/// Distance from the address of a module to its running bit, which resets the module when written.
pub(super) const RESET_OFFSET: u16 = MODULES as u16;

const fn zone(letter: char) -> u16 {
    let mut n = 0;
    while n < ZONE_LETTERS.len() && ZONE_LETTERS[n] != letter {
        n += 1;
    }
    n as u16 * ZONE_BITS
}

/// Address of every cell, as the eleven-bit addresses of instructions.
#[derive(Debug)]
pub(super) struct Ap101Layout {
    /// Address of each bit cell.
    pub bits: Vec<u16>,
    /// Bits whose value is not needed between scans.
    pub temporary: HashSet<BitId>,
    /// Module number of each word cell.
    pub words: Vec<u16>,
    /// Edge memories of modules whose own edge detection does not fit, by word.
    pub module_edge_bits: HashMap<WordId, u16>,
    /// A bit that saves a value while A is needed for another one.
    pub scratch: u16,
    /// Outputs that are copied at the end of the scan: address of the image and of the channel.
    pub late_outputs: Vec<(u16, u16)>,
    /// Number of input channels, up to the last one in use.
    pub inputs: u16,
    /// Number of output channels, up to the last one in use.
    pub outputs: u16,
    /// Configuration of the modules.
    pub modules: [ModuleSettings; MODULES],
    /// Number of bits of M in use, not counting those of outputs.
    pub memory_bits: u32,
}

/// Assigns places to all cells of `job`.
///
/// # Errors
/// The program needs more bits or modules than the machine has; the messages contain the numbers.
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
    for (number, UsedModule { module, word, limit }) in (0..).zip(&whole) {
        if let Some(place) = words.get_mut(word.0 as usize) {
            *place = number;
        }
        if let Some(place) = settings.get_mut(usize::from(number)) {
            *place = module_settings(*module, *limit);
        }
    }
    if whole.len() > MODULES {
        let cause = format!("the program has {} timers and counters, the machine has {MODULES}", whole.len());
        refusals.push(BuildRefusal::Unsupported { cause, hint: "use fewer of them".to_owned(), element: None });
    }

    // Images of unused channels are ordinary memory.
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
    let own_edges = whole.iter().filter(|used| needs_edge_memory(used.module));
    let edges = own_edges.map(|used| (used.word, give())).collect();
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

/// Location of a bit for the map. For an output channel this is its image, which is written together with the
/// channel.
pub(super) fn bit_place(addr: u16) -> CellLocation {
    let (zone, offset) = (addr / ZONE_BITS * ZONE_BITS, addr % ZONE_BITS);
    let (space, offset) = match zone {
        E_ZONE => ("m", FIRST_OUTPUT_IMAGE + offset),
        M_ZONE => ("m", offset),
        _ => ("i", offset),
    };
    CellLocation::Bit { space: space.to_owned(), addr: offset.into(), bit: 0 }
}

/// A timer or counter of the program.
pub(super) struct UsedModule {
    /// What it does.
    pub module: TimedModule,
    /// The word with its value.
    pub word: WordId,
    /// The value at which its output changes.
    pub limit: WordOperand,
}

/// Timers and counters of the program, in order.
pub(super) fn used_modules(ir: &Ir) -> Vec<UsedModule> {
    let mut found = Vec::new();
    for_each_op(ir, &mut |op, _| {
        if let IrOp::Module { module, word, limit } = op {
            found.push(UsedModule { module: *module, word: *word, limit: *limit });
        }
    });
    found
}

/// Calls `look` with every operation, and whether the operation is executed in every scan.
pub(super) fn for_each_op<'a>(ir: &'a Ir, look: &mut dyn FnMut(&'a IrOp, bool)) {
    let rungs = ir.rungs.iter().flat_map(|rung| &rung.steps).map(|step| &step.op);
    for op in ir.prologue.iter().chain(rungs).chain(&ir.epilogue) {
        let mut always = !ir.has_jumps();
        for_each_nested_op(op, &mut |op| look(op, std::mem::replace(&mut always, false)));
    }
}

/// Calls `look` with an operation and with all operations nested in it.
pub(super) fn for_each_nested_op<'a>(op: &'a IrOp, look: &mut dyn FnMut(&'a IrOp)) {
    look(op);
    if let IrOp::If { if_true: then, if_false: otherwise, .. } = op {
        then.iter().chain(otherwise).for_each(|op| for_each_nested_op(op, look));
    }
}

/// The bit that an operation writes, if any.
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

/// Bits that a single operation writes, in every scan.
fn directly_written_bits(ir: &Ir) -> HashSet<BitId> {
    let mut writes: HashMap<BitId, (u32, bool)> = HashMap::new();
    for_each_op(ir, &mut |op, always| {
        if let Some(bit) = written_bit(op) {
            // Edge operations write their memory with several instructions.
            let whole = always && !matches!(op, IrOp::Rising(_) | IrOp::Falling(_));
            let (count, all) = writes.entry(bit).or_insert((0, true));
            (*count, *all) = (*count + 1, *all && whole);
        }
    });
    writes.into_iter().filter(|(_, (count, whole))| *count == 1 && *whole).map(|(bit, _)| bit).collect()
}

/// True if a counter needs an edge memory of its own, because its module does not receive the input
/// unchanged.
pub(super) fn needs_edge_memory(is: TimedModule) -> bool {
    matches!(is, TimedModule::Counter { input: '/' | '\\', .. }) && !writes_input_directly(is)
}

/// True if the input of the element is written to its module unchanged.
pub(super) fn writes_input_directly(is: TimedModule) -> bool {
    match is {
        TimedModule::Timer(_) => true,
        TimedModule::Counter { kind, input, bounded } => input == '/' && (!bounded || kind == CounterKind::Ctc),
    }
}

/// Preset of a module; `None` if it does not fit.
///
/// A bounded CTD is true for n > max but a module for n >= preset, so its preset is max + 1.
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
