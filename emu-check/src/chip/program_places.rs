//! The compiler's map, resolved for one chip: the address or pin of everything that a check reads, writes or
//! drives.

use std::ops::RangeInclusive;

use diag::{Diagnostic, Pos, Severity};
use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::pins::PinId;
use ladder::LadderProgram;
use ladder_compile::{CellLocation, ImageMap};
use ladder_eval::Evaluator;

use crate::chip::families::{self, PinBehaviour};
use crate::chip::map_contract::ScanPace;
use crate::chip::peripherals::CheckedPeripherals;
use crate::chip::port_pins::{self, PortPins};
use crate::codes;

/// A point of a scan at which the chip is stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ScanPoint {
    /// The instruction that starts the pacing timer.
    TimerStart,
    /// The first instruction of a scan; inputs are latched after it.
    ScanStart,
    /// The first instruction of the first rung; inputs have been latched.
    FirstRung,
    /// The last instruction of a scan; outputs have been written.
    ScanEnd,
}

/// All addresses and pins of a program on its chip. Code addresses are program words.
#[derive(Debug, Clone)]
pub(crate) struct ProgramPlaces {
    timer_start: u32,
    scan_start: u32,
    /// `None` if the rungs have no separate address.
    first_rung: Option<u32>,
    scan_end: u32,
    /// Start address and index of each rung that has code. The last entry is the end of all rungs, with index
    /// `usize::MAX`.
    pub rungs: Vec<(u32, usize)>,
    /// Timing of a scan, computed from the program's settings.
    pub pace: ScanPace,
    /// Locations of the symbols, in the evaluator's order.
    symbols: Vec<CellLocation>,
    /// Outputs: symbol index and pin.
    pub outputs: Vec<(usize, PinId)>,
    /// Pins of the inputs, in the order of the evaluator's symbols.
    pub inputs: Vec<PinId>,
    /// The peripherals that the program uses in addition to ports.
    pub peripherals: CheckedPeripherals,
    /// Ports whose registers the program names.
    pub ports: Vec<PortPins>,
    /// Pins that the program does not name and the chip must not drive.
    pub undriven_pins: Vec<PinId>,
    /// Pins that the program does not name and the board may drive.
    pub drivable_pins: Vec<PinId>,
    chip: &'static Chip,
    /// Bytes per program word.
    pub word_bytes: u32,
}

impl ProgramPlaces {
    /// Resolves the map; the error lists everything that the map lacks or that does not fit the chip.
    pub(crate) fn new(
        program: &LadderProgram,
        map: &ImageMap,
        chip: &'static Chip,
        eval: &Evaluator,
        pace: ScanPace,
    ) -> Result<ProgramPlaces, Vec<Diagnostic>> {
        let mut faults = Vec::new();
        let mut fault = |cause: String| {
            let hint = "compile the program again; map and image must come from one compilation";
            faults.push(Diagnostic::new(Severity::Error, codes::BAD_MAP, &program.file, Pos::default(), cause, hint));
        };
        let mut symbols = Vec::new();
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        for (index, symbol) in eval.symbols().iter().enumerate() {
            match map.symbols.iter().find(|s| s.name == symbol.name) {
                Some(found) if matches!(found.place, CellLocation::Bit { .. }) == symbol.kind.is_bit() => {
                    symbols.push(found.place.clone());
                }
                Some(_) => fault(format!("the map has a place of the wrong kind for `{}`", symbol.name)),
                None => fault(format!("the map has no place for `{}`", symbol.name)),
            }
            let wanted = match symbol.kind {
                ladder::SymbolKind::Input => "in",
                ladder::SymbolKind::Output => "out",
                _ => continue,
            };
            let found = map.pins.iter().find(|p| p.name == symbol.name && p.direction == wanted);
            match found.and_then(|p| chip.pin(&p.pin)) {
                Some(pin) if wanted == "in" => inputs.push(pin),
                Some(pin) => outputs.push((index, pin)),
                None => fault(format!("the map has no pin of {} for `{}`", chip.name, symbol.name)),
            }
        }
        let peripherals = match CheckedPeripherals::new(program, map, chip, eval, &pace) {
            Ok(peripherals) => Some(peripherals),
            Err(causes) => {
                causes.into_iter().for_each(&mut fault);
                None
            }
        };
        let Some(peripherals) = peripherals.filter(|_| faults.is_empty()) else { return Err(faults) };
        let ports = inputs.iter().copied().chain(outputs.iter().map(|o: &(usize, PinId)| o.1));
        let mut named: Vec<PinId> = ports.chain(peripherals.pins()).collect();
        let ports = port_pins::port_pins(program, chip, eval, &named);
        named.extend(ports.iter().flat_map(|port| port.pins.iter().map(|pin| pin.1)));
        let unnamed = families::unnamed_pins(chip, &named);
        let word = |byte: u32| byte / chip.word_bytes.max(1);
        let points = [map.timer_start, map.scan_start, map.scan_end].map(word);
        let [timer_start, scan_start, scan_end] = points;
        let ends = map.rungs.iter().map(|rung| rung.end).max();
        let begins =
            (0..).zip(&map.rungs).filter(|(_, rung)| rung.start < rung.end).map(|(n, rung)| (word(rung.start), n));
        Ok(ProgramPlaces {
            rungs: begins.chain(ends.map(|end| (word(end), usize::MAX))).collect(),
            timer_start,
            scan_start,
            first_rung: map.rungs.first().map(|r| word(r.start)).filter(|pc| !points.contains(pc)),
            scan_end,
            pace,
            symbols,
            outputs,
            inputs,
            peripherals,
            ports,
            undriven_pins: unnamed.undriven,
            drivable_pins: unnamed.drivable,
            chip,
            word_bytes: chip.word_bytes.max(1),
        })
    }

    /// The chip's name of a pin, such as `PD2`.
    pub(crate) fn pin_name(&self, pin: PinId) -> &'static str {
        self.chip.pins.get(usize::from(pin)).map_or("?", |p| p.name)
    }

    /// The electrical behaviour of a pin; `None` on a machine whose pins are always driven.
    pub(crate) fn pin_behaviour(&self, pin: PinId) -> Option<PinBehaviour> {
        families::pin_behaviour(self.chip, pin)
    }

    /// Returns true for AP101, which itself repeats the program with a fixed period and latches inputs before
    /// the first instruction of a scan: it needs neither a timer nor a polling loop.
    pub(crate) fn is_self_paced(&self) -> bool {
        self.chip.is_bit_controller()
    }

    /// The supply pin of a self-paced machine, which halts when no event is due.
    pub(crate) fn supply_pin(&self) -> Option<PinId> {
        self.chip.pin("POWER").filter(|_| self.is_self_paced())
    }

    /// Returns true if the program word `pc` is a point of the scan.
    pub(crate) fn is_scan_point(&self, pc: u32) -> bool {
        [Some(self.timer_start), Some(self.scan_start), self.first_rung, Some(self.scan_end)].contains(&Some(pc))
    }

    /// Returns the number of output channels of an AP101 that the configuration uses.
    pub(crate) fn output_channels<C: Cpu>(&self, cpu: &C) -> u64 {
        let output = |pin: &PinId| self.pin_name(*pin).starts_with('E') && cpu.has_pin(*pin);
        (0..self.chip.pins.len() as PinId).filter(output).count() as u64
    }

    /// The program word of `point`; `None` if the program has no separate address for it.
    pub(crate) fn point_word(&self, point: ScanPoint) -> Option<u32> {
        match point {
            ScanPoint::TimerStart => Some(self.timer_start),
            ScanPoint::ScanStart => Some(self.scan_start),
            ScanPoint::FirstRung => self.first_rung,
            ScanPoint::ScanEnd => Some(self.scan_end),
        }
    }

    /// Machine cycles per period, rounded up.
    pub(crate) fn period_cycles(&self) -> u64 {
        u64::try_from(self.pace.num.div_ceil(self.pace.den)).unwrap_or(u64::MAX)
    }

    /// The window in which scan `scan` (from 1) may start, in machine cycles since the start of the timer.
    pub(crate) fn start_window(&self, scan: u64) -> RangeInclusive<u64> {
        let ScanPace { num, den, tick_cycles: tick, poll_cycles: poll, .. } = self.pace;
        let exact = u64::try_from(u128::from(scan).saturating_mul(num) / den).unwrap_or(u64::MAX);
        // With an integer period and a tick of one cycle, matches are exact; otherwise a match may be one
        // tick early.
        let early = if tick == 1 && den == 1 { 0 } else { tick };
        exact.saturating_sub(early)..=exact.saturating_add(poll)
    }

    /// Reads a symbol on the chip; a location outside of its memories reads as 0.
    pub(crate) fn read_symbol<C: Cpu>(&self, cpu: &C, symbol: usize) -> i32 {
        match self.symbols.get(symbol) {
            Some(CellLocation::Bit { space, addr, bit }) => i32::from(cpu.peek(space, *addr).unwrap_or(0) >> bit & 1),
            Some(CellLocation::Word { space, addr, bytes }) => {
                let byte = |n: u8| i32::from(cpu.peek(space, addr + u32::from(n)).unwrap_or(0)) << (8 * n);
                let unused = 32 - 8 * u32::from((*bytes).clamp(1, 4));
                (0..(*bytes).min(4)).map(byte).fold(0, |all, byte| all | byte) << unused >> unused
            }
            None => 0,
        }
    }

    /// Writes a symbol on the chip, as a debugger does.
    pub(crate) fn write_symbol<C: Cpu>(&self, cpu: &mut C, symbol: usize, value: i32) {
        match self.symbols.get(symbol) {
            Some(CellLocation::Bit { space, addr, bit }) => {
                let old = cpu.peek(space, *addr).unwrap_or(0) & !(1 << bit);
                cpu.poke(space, *addr, old | u8::from(value != 0) << bit);
            }
            Some(CellLocation::Word { space, addr, bytes }) => {
                for (n, byte) in (0..u32::from(*bytes)).zip(value.to_le_bytes()) {
                    cpu.poke(space, addr + n, byte);
                }
            }
            None => {}
        }
    }
}
