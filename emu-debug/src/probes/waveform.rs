//! Waveforms: the pins as wires and the bytes sent, in a VCD file (IEEE 1364-2005, section 18).

use std::io::{self, Write};

use emu_core::chip::{Chip, PinDef};
use emu_core::pins::{ChipEvent, CycleTime, PinLevel};
use vcd::{IdCode, SimulationCommand, TimescaleUnit, Value, VarType, Writer};

use crate::text::time::CycleClock;

/// A signal that is written in addition to the pins.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WaveSignal {
    /// Name, without white space.
    pub name: String,
    /// Number of bits, 1 to 64.
    pub bits: u32,
    /// Initial value.
    pub value: Option<u64>,
}

/// What is written in addition to the pins.
#[derive(Debug, Clone, Copy, Default)]
pub struct WaveExtras<'a> {
    /// The time of the chip at which the waveform begins.
    pub start: CycleTime,
    /// Whether the chip has a serial port.
    pub uart: bool,
    /// The signals after the pins.
    pub wave_signals: &'a [WaveSignal],
    /// Without vectors: each bit of a wide signal is a wire of its own. Some readers do not support vectors,
    /// and stop at the first one.
    pub split: bool,
}

/// A signal in the file.
enum VcdWires {
    Bit(IdCode),
    Vector(IdCode, u32),
    /// Bits, the lowest first.
    Bits(Vec<IdCode>),
}

impl VcdWires {
    /// Declares a signal.
    fn new(out: &mut Writer<Box<dyn Write>>, name: &str, bits: u32, split: bool) -> io::Result<VcdWires> {
        Ok(match bits {
            1 => VcdWires::Bit(out.add_wire(1, name)?),
            _ if !split => VcdWires::Vector(out.add_var(VarType::Reg, bits, name, None)?, bits),
            _ => VcdWires::Bits(
                (0..bits).map(|bit| out.add_wire(1, &format!("{name}_{bit}"))).collect::<Result<_, _>>()?,
            ),
        })
    }

    /// Writes its value.
    fn change(&self, out: &mut Writer<Box<dyn Write>>, value: Option<u64>) -> io::Result<()> {
        let bit = |bit: u32| value.map_or(Value::X, |value| Value::from(value >> bit & 1 == 1));
        match self {
            VcdWires::Bit(wire) => out.change_scalar(*wire, bit(0)),
            VcdWires::Vector(wire, bits) => out.change_vector(*wire, (0..*bits).rev().map(bit)),
            VcdWires::Bits(wires) => (0..).zip(wires).try_for_each(|(at, wire)| out.change_scalar(*wire, bit(at))),
        }
    }
}

/// Writes a VCD file while a chip runs.
pub struct WaveWriter {
    out: Writer<Box<dyn Write>>,
    pins: Vec<Option<IdCode>>,
    /// The last sent byte, and the event that one was sent; on chips with a serial port.
    uart: Option<(VcdWires, IdCode)>,
    signals: Vec<VcdWires>,
    scale: VcdTimescale,
    /// The last time that was written.
    last_tick: u64,
    /// The first write error.
    first_error: Option<io::Error>,
}

impl WaveWriter {
    /// Writes the header and the initial levels, one for each of the chip's pins; `None` for pins that are
    /// left out. `uart`: the chip has a serial port.
    ///
    /// # Errors
    /// The errors of `out`.
    pub fn new(
        out: Box<dyn Write>,
        chip: &Chip,
        clock: CycleClock,
        levels: &[Option<PinLevel>],
        uart: bool,
    ) -> io::Result<WaveWriter> {
        WaveWriter::with_extras(out, chip, clock, levels, WaveExtras { uart, ..WaveExtras::default() })
    }

    /// Creates a writer of the pins, as [`WaveWriter::new`] does, and of more signals.
    ///
    /// # Errors
    /// The errors of the output.
    pub fn with_extras(
        out: Box<dyn Write>,
        chip: &Chip,
        clock: CycleClock,
        levels: &[Option<PinLevel>],
        WaveExtras { start, uart, wave_signals, split }: WaveExtras<'_>,
    ) -> io::Result<WaveWriter> {
        let mut out = Writer::new(out);
        let scale = VcdTimescale::of(clock);
        out.version(concat!("emu ", env!("CARGO_PKG_VERSION")))?;
        out.comment(&format!("{} at {} Hz", chip.name, clock.hz))?;
        out.timescale(scale.number, scale.unit)?;
        out.add_module(chip.name)?;
        let wire = |(pin, there): (&PinDef, &Option<PinLevel>)| there.map(|_| out.add_wire(1, pin.name)).transpose();
        let pins = chip.pins.iter().zip(levels).map(wire).collect::<io::Result<Vec<_>>>()?;
        let uart = match uart {
            true => {
                let byte = VcdWires::new(&mut out, "uart0_byte", 8, split)?;
                Some((byte, out.add_var(VarType::Event, 1, "uart0_sent", None)?))
            }
            false => None,
        };
        let signals =
            if wave_signals.is_empty() { Vec::new() } else { declare_signals(&mut out, wave_signals, split)? };
        out.upscope()?;
        out.enddefinitions()?;
        let last = scale.ticks(start);
        out.timestamp(last)?;
        out.begin(SimulationCommand::Dumpvars)?;
        for (wire, level) in pins.iter().zip(levels).filter_map(|(wire, level)| Some(((*wire)?, (*level)?))) {
            out.change_scalar(wire, vcd_value(level))?;
        }
        if let Some((byte, _)) = &uart {
            byte.change(&mut out, None)?;
        }
        for (wires, column) in signals.iter().zip(wave_signals) {
            wires.change(&mut out, column.value)?;
        }
        out.end()?;
        Ok(WaveWriter { out, pins, uart, signals, scale, last_tick: last, first_error: None })
    }

    /// Records a new value of a signal from machine cycle `cycle` on. `index` is the position of the signal
    /// in the list with which the writer was made; `None` is an unknown value.
    pub fn change_signal(&mut self, cycle: u64, index: usize, value: Option<u64>) {
        if self.first_error.is_none() {
            let written = self.advance_to(CycleTime::at(cycle)).and_then(|()| match self.signals.get(index) {
                Some(wires) => wires.change(&mut self.out, value),
                None => Ok(()),
            });
            self.first_error = written.err();
        }
    }

    /// Returns true if a write failed.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.first_error.is_some()
    }

    /// Records an event.
    pub fn write_event(&mut self, event: ChipEvent) {
        if self.first_error.is_none() {
            self.first_error = self.write(event).err();
        }
    }

    /// Ends the file at machine cycle `cycle`.
    ///
    /// # Errors
    /// The first write error.
    pub fn finish(mut self, cycle: u64) -> io::Result<()> {
        if let Some(error) = self.first_error.take() {
            return Err(error);
        }
        self.advance_to(CycleTime::at(cycle))?;
        self.out.flush()
    }

    fn advance_to(&mut self, time: CycleTime) -> io::Result<()> {
        let ticks = self.scale.ticks(time);
        if ticks > self.last_tick {
            self.last_tick = ticks;
            self.out.timestamp(ticks)?;
        }
        Ok(())
    }

    fn write(&mut self, event: ChipEvent) -> io::Result<()> {
        self.advance_to(event.time())?;
        match event {
            ChipEvent::Edge { pin, level, .. } => match self.pins.get(usize::from(pin)) {
                Some(&Some(wire)) => self.out.change_scalar(wire, vcd_value(level)),
                _ => Ok(()),
            },
            ChipEvent::Sent { uart: 0, byte: sent, .. } => {
                let Some((byte, event)) = &self.uart else { return Ok(()) };
                byte.change(&mut self.out, Some(sent.into()))?;
                self.out.change_scalar(*event, Value::V1)
            }
            ChipEvent::Sent { .. } | ChipEvent::Contention { .. } | ChipEvent::Reset { .. } => Ok(()),
        }
    }
}

/// Declares the signals in a scope of their own, so that their names do not clash with pins.
fn declare_signals(
    out: &mut Writer<Box<dyn Write>>,
    wave_signals: &[WaveSignal],
    split: bool,
) -> io::Result<Vec<VcdWires>> {
    out.add_module("signals")?;
    let wires = wave_signals.iter().map(|column| VcdWires::new(out, &column.name, column.bits, split));
    let wires = wires.collect::<io::Result<_>>()?;
    out.upscope()?;
    Ok(wires)
}

fn vcd_value(level: PinLevel) -> Value {
    match level {
        PinLevel::Low => Value::V0,
        PinLevel::High => Value::V1,
        PinLevel::Float | PinLevel::PullUp | PinLevel::PullDown => Value::Z,
    }
}

/// Ticks of the file per second, and their notation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct VcdTimescale {
    number: u32,
    unit: TimescaleUnit,
    per_second: u128,
    clock: CycleClock,
}

impl VcdTimescale {
    /// Returns the coarsest of 1 ns, 100 ps, 10 ps and 1 ps in which a clock is a whole number of ticks;
    /// otherwise 1 ps, with times rounded down.
    fn of(clock: CycleClock) -> VcdTimescale {
        let clock = CycleClock { hz: clock.hz.max(1), ..clock };
        let scales = [
            (1, TimescaleUnit::NS, 1_000_000_000),
            (100, TimescaleUnit::PS, 10_000_000_000),
            (10, TimescaleUnit::PS, 100_000_000_000),
            (1, TimescaleUnit::PS, 1_000_000_000_000u128),
        ];
        let exact = scales.iter().find(|(.., per_second)| per_second % u128::from(clock.hz) == 0);
        let &(number, unit, per_second) = exact.unwrap_or(&scales[3]);
        VcdTimescale { number, unit, per_second, clock }
    }

    fn ticks(&self, time: CycleTime) -> u64 {
        let clocks = u128::from(time.cycle) * u128::from(self.clock.clocks_per_cycle) + u128::from(time.phase);
        u64::try_from(clocks * self.per_second / u128::from(self.clock.hz)).unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hz, expected time scale, cycle, expected tick.
    const SCALES: &[(u64, u32, TimescaleUnit, u64, u64)] = &[
        (8_000_000, 1, TimescaleUnit::NS, 3, 375),
        (16_000_000, 100, TimescaleUnit::PS, 3, 1_875),
        (32_000_000, 10, TimescaleUnit::PS, 1, 3_125),
        (12_800_000, 1, TimescaleUnit::PS, 1, 78_125),
        (14_745_600, 1, TimescaleUnit::PS, 2, 135_633),
        (3_000_000, 1, TimescaleUnit::PS, 1, 333_333),
        (3_000_000, 1, TimescaleUnit::PS, 3, 1_000_000),
        (1, 1, TimescaleUnit::NS, 2, 2_000_000_000),
    ];

    #[test]
    fn time_scales() {
        for &(hz, number, unit, cycle, tick) in SCALES {
            let scale = VcdTimescale::of(CycleClock { hz, clocks_per_cycle: 1 });
            assert_eq!((scale.number, scale.unit), (number, unit), "{hz}");
            assert_eq!(scale.ticks(CycleTime::at(cycle)), tick, "{hz}");
        }
    }
}
