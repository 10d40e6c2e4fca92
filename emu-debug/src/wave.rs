//! Waveforms: the pins as wires and the bytes sent, in a VCD file (IEEE 1364-2005, section 18).

use std::io::{self, Write};

use emu_core::chip::{Chip, PinDef};
use emu_core::pins::{Event, Level, Time};
use vcd::{IdCode, SimulationCommand, TimescaleUnit, Value, VarType, Writer};

use crate::time::Clock;

/// Writes a VCD file while a chip runs.
pub struct Wave {
    out: Writer<Box<dyn Write>>,
    pins: Vec<Option<IdCode>>,
    /// The byte last sent, and the event that one was; on chips with a serial port.
    uart: Option<(IdCode, IdCode)>,
    scale: Scale,
    /// Last time written.
    last: u64,
    /// The first thing that could not be written.
    failed: Option<io::Error>,
}

impl Wave {
    /// Writes the head and the levels at the start, one for each of the chip's pins, none for those that are left out. `uart`: the
    /// chip has a serial port.
    ///
    /// # Errors
    /// What `out` says.
    pub fn new(
        out: Box<dyn Write>,
        chip: &Chip,
        clock: Clock,
        levels: &[Option<Level>],
        uart: bool,
    ) -> io::Result<Wave> {
        let mut out = Writer::new(out);
        let scale = Scale::of(clock);
        out.version(concat!("emu ", env!("CARGO_PKG_VERSION")))?;
        out.comment(&format!("{} at {} Hz", chip.name, clock.hz))?;
        out.timescale(scale.number, scale.unit)?;
        out.add_module(chip.name)?;
        let wire = |(pin, there): (&PinDef, &Option<Level>)| there.map(|_| out.add_wire(1, pin.name)).transpose();
        let pins = chip.pins.iter().zip(levels).map(wire).collect::<io::Result<Vec<_>>>()?;
        let uart = match uart {
            true => {
                let byte = out.add_var(VarType::Reg, 8, "uart0_byte", None)?;
                Some((byte, out.add_var(VarType::Event, 1, "uart0_sent", None)?))
            }
            false => None,
        };
        out.upscope()?;
        out.enddefinitions()?;
        out.timestamp(0)?;
        out.begin(SimulationCommand::Dumpvars)?;
        for (wire, level) in pins.iter().zip(levels).filter_map(|(wire, level)| Some(((*wire)?, (*level)?))) {
            out.change_scalar(wire, value(level))?;
        }
        if let Some((byte, _)) = uart {
            out.change_vector(byte, [Value::X; 8])?;
        }
        out.end()?;
        Ok(Wave { out, pins, uart, scale, last: 0, failed: None })
    }

    /// Notes an event.
    pub fn event(&mut self, event: Event) {
        if self.failed.is_none() {
            self.failed = self.write(event).err();
        }
    }

    /// Ends the file at machine cycle `cycle`.
    ///
    /// # Errors
    /// The first thing that could not be written.
    pub fn finish(mut self, cycle: u64) -> io::Result<()> {
        if let Some(error) = self.failed.take() {
            return Err(error);
        }
        self.at(Time::at(cycle))?;
        self.out.flush()
    }

    fn at(&mut self, time: Time) -> io::Result<()> {
        let ticks = self.scale.ticks(time);
        if ticks > self.last {
            self.last = ticks;
            self.out.timestamp(ticks)?;
        }
        Ok(())
    }

    fn write(&mut self, event: Event) -> io::Result<()> {
        self.at(event.at())?;
        match event {
            Event::Edge { pin, level, .. } => match self.pins.get(usize::from(pin)) {
                Some(&Some(wire)) => self.out.change_scalar(wire, value(level)),
                _ => Ok(()),
            },
            Event::Sent { uart: 0, byte: sent, .. } => {
                let Some((byte, event)) = self.uart else { return Ok(()) };
                let bits = (0..8).rev().map(|bit| Value::from(sent >> bit & 1 == 1));
                self.out.change_vector(byte, bits)?;
                self.out.change_scalar(event, Value::V1)
            }
            Event::Sent { .. } | Event::Contention { .. } => Ok(()),
        }
    }
}

fn value(level: Level) -> Value {
    match level {
        Level::Low => Value::V0,
        Level::High => Value::V1,
        Level::Float | Level::PullUp | Level::PullDown => Value::Z,
    }
}

/// Ticks of the file per second, and how they are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Scale {
    number: u32,
    unit: TimescaleUnit,
    per_second: u128,
    clock: Clock,
}

impl Scale {
    /// The coarsest of 1 ns, 100 ps, 10 ps and 1 ps in which a clock is a whole number of ticks; 1 ps where it is in
    /// none, and then times are rounded down.
    fn of(clock: Clock) -> Scale {
        let clock = Clock { hz: clock.hz.max(1), ..clock };
        let scales = [
            (1, TimescaleUnit::NS, 1_000_000_000),
            (100, TimescaleUnit::PS, 10_000_000_000),
            (10, TimescaleUnit::PS, 100_000_000_000),
            (1, TimescaleUnit::PS, 1_000_000_000_000u128),
        ];
        let exact = scales.iter().find(|(.., per_second)| per_second % u128::from(clock.hz) == 0);
        let &(number, unit, per_second) = exact.unwrap_or(&scales[3]);
        Scale { number, unit, per_second, clock }
    }

    fn ticks(&self, time: Time) -> u64 {
        let clocks = u128::from(time.cycle) * u128::from(self.clock.clocks_per_cycle) + u128::from(time.phase);
        u64::try_from(clocks * self.per_second / u128::from(self.clock.hz)).unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hz, wanted time scale, cycle, wanted tick.
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
            let scale = Scale::of(Clock { hz, clocks_per_cycle: 1 });
            assert_eq!((scale.number, scale.unit), (number, unit), "{hz}");
            assert_eq!(scale.ticks(Time::at(cycle)), tick, "{hz}");
        }
    }
}
