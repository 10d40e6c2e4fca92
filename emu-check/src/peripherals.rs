//! Pins with another job than input and output: the serial line, the converter, the PWM output; and the cells of the EEPROM.

use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::pins::{Level, PinId, Time};
use emu_core::rng::Rng;
use ladder::{Element, Program};
use ladder_compile::{Map, Special};
use ladder_eval::Evaluator;

use crate::contract::Pace;
use crate::pulse::Wanted;
use crate::wire::{Bit, levels};

/// Steps of the converter, and its reference in millivolts.
const STEPS: u32 = 1024;
const REFERENCE: u32 = 5_000;

/// What a program uses of the chip besides its ports.
#[derive(Debug, Clone)]
pub(crate) struct Peripherals {
    /// The pin that sends, and the one that receives.
    pub transmit: Option<PinId>,
    pub receive: Option<PinId>,
    pub bit: Bit,
    /// The converter's symbols, in the evaluator's order, with their pins.
    pub analog: Vec<(usize, PinId)>,
    pub pwm: Option<(PinId, Wanted)>,
    /// Cells of the EEPROM, from address 0.
    pub cells: u32,
    /// Clocks of a machine cycle.
    pub clocks: u64,
}

impl Peripherals {
    /// Finds the pins in the map; the causes where something has none.
    pub(crate) fn new(
        program: &Program,
        map: &Map,
        chip: &Chip,
        eval: &Evaluator,
        pace: &Pace,
    ) -> Result<Peripherals, Vec<String>> {
        let mut faults = Vec::new();
        let mut pin = |what: &str, wanted: bool, of: &dyn Fn(&Special) -> Option<&String>| {
            let name = map.specials.iter().find_map(of).filter(|_| wanted)?;
            let found = chip.pin(name);
            if found.is_none() {
                faults.push(format!("{} has no pin {name} for {what}", chip.name));
            }
            found
        };
        let (sends, receives) = serial(program);
        let transmit = pin("the transmitter", sends, &|special| match special {
            Special::Transmit { pin, .. } => Some(pin),
            _ => None,
        });
        let receive = pin("the receiver", receives, &|special| match special {
            Special::Receive { pin, .. } => Some(pin),
            _ => None,
        });
        let pulses = eval.pwm_hz().is_some();
        let pwm = pin("the PWM output", pulses, &|special| match special {
            Special::Pwm { pin, .. } => Some(pin),
            _ => None,
        });
        let wanted = map.specials.iter().find_map(|special| match special {
            Special::Pwm { period, steps, .. } => Some(Wanted {
                period: (u128::from(period.num) * u128::from(pace.clocks), period.den.into()),
                steps: u64::from(*steps),
                grain: pace.clocks,
            }),
            _ => None,
        });
        let mut analog = Vec::new();
        for symbol in eval.adc_symbols() {
            let name = eval.symbols().get(symbol).map_or("", |s| s.name.as_str());
            let at = pin(name, true, &|special| match special {
                Special::Analog { pin, name: of } if of == name => Some(pin),
                _ => None,
            });
            analog.extend(at.map(|at| (symbol, at)));
        }
        let needs = [
            (sends && transmit.is_none(), "the transmitter"),
            (receives && receive.is_none(), "the receiver"),
            (pulses && pwm.is_none(), "the PWM output"),
            (analog.len() < eval.adc_symbols().count(), "an analog input"),
        ];
        faults
            .extend(needs.iter().filter(|(lacks, _)| *lacks).map(|(_, what)| format!("the map has no pin for {what}")));
        if !faults.is_empty() {
            return Err(faults);
        }
        Ok(Peripherals {
            transmit,
            receive,
            bit: Bit { hz: pace.clock_hz, baud: program.settings.baud.unwrap_or(1) },
            analog,
            pwm: pwm.zip(wanted),
            cells: eval.eeprom().len() as u32,
            clocks: pace.clocks,
        })
    }

    /// All their pins.
    pub(crate) fn pins(&self) -> impl Iterator<Item = PinId> {
        let serial = self.transmit.into_iter().chain(self.receive);
        serial.chain(self.pwm.map(|pwm| pwm.0)).chain(self.analog.iter().map(|analog| analog.1))
    }

    /// A clock as a moment of the chip.
    pub(crate) fn time(&self, clock: u64) -> Time {
        Time { cycle: clock / self.clocks, phase: (clock % self.clocks) as u8 }
    }

    /// A moment of the chip as a clock.
    pub(crate) fn clock(&self, at: Time) -> u64 {
        at.cycle * self.clocks + u64::from(at.phase)
    }

    /// Puts a voltage on an analog input of which a conversion gives `value`: the middle of its step.
    pub(crate) fn put<C: Cpu>(&self, cpu: &mut C, pin: PinId, value: u16) {
        let millivolts = (2 * u32::from(value) + 1) * REFERENCE / (2 * STEPS);
        cpu.drive_volts(Time::at(cpu.cycle()), pin, millivolts);
    }

    /// Queues a byte for the receiver whose start bit begins at the clock `start`.
    pub(crate) fn send<C: Cpu>(&self, cpu: &mut C, start: u64, byte: u8) {
        let Some(pin) = self.receive else { return };
        levels(self.bit, byte).for_each(|(after, high)| cpu.drive(self.time(start + after), pin, Level::of(high)));
    }

    /// What the EEPROM holds when a run with this seed begins: erased, or anything, as programs before have left it.
    pub(crate) fn eeprom(&self, seed: u64) -> impl Iterator<Item = u8> + use<> {
        let mut rng = Rng::new(seed ^ 0xEE);
        let erased = rng.one_in(2);
        (0..self.cells).map(move |_| if erased || rng.one_in(4) { 0xFF } else { rng.next_u64() as u8 })
    }
}

/// Whether a program sends bytes, and whether it receives any.
pub(crate) fn serial(program: &Program) -> (bool, bool) {
    let any = |what: fn(&Element) -> bool| program.elements().any(|(_, element, _)| what(element));
    let sends = any(|e| matches!(e, Element::UartSend { .. } | Element::FormattedString { .. }));
    (sends, any(|e| matches!(e, Element::UartRecv { .. })))
}
