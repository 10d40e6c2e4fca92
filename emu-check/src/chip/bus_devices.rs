//! The checker's own devices on the I2C and SPI bus of a chip. They note what the chip does there, from the
//! edges at its pins, and answer every read with one byte.

use emu_core::pins::{PinId, PinLevel};
use ladder_eval::{BusEvent, Evaluator};

use crate::chip::deviation::Deviation;

/// Pins of the buses that a program uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct BusPins {
    /// Data and clock of the I2C bus.
    pub i2c: Option<(PinId, PinId)>,
    /// Select, clock, data out and data in of the SPI bus.
    pub spi: Option<[PinId; 4]>,
}

impl BusPins {
    /// All pins of the buses.
    pub(crate) fn pins(&self) -> impl Iterator<Item = PinId> + use<> {
        self.i2c.into_iter().flat_map(|(data, clock)| [data, clock]).chain(self.spi.into_iter().flatten())
    }

    /// Lines that a resistor of the board holds high.
    pub(crate) fn pull_ups(&self) -> impl Iterator<Item = PinId> + use<> {
        let data_in = self.spi.map(|[.., data_in]| data_in);
        self.i2c.into_iter().flat_map(|(data, clock)| [data, clock]).chain(data_in)
    }
}

/// The devices of both buses; a clone goes on independently.
#[derive(Debug, Clone)]
pub(crate) struct BusDevices {
    pins: BusPins,
    i2c: I2cDevice,
    spi: SpiDevice,
    /// The byte that they answer.
    pub answer: u8,
    /// What happened since it was taken, in order.
    pub events: Vec<BusEvent>,
    /// The first thing that was wrong.
    pub fault: Option<String>,
    /// A pin that a device drives from now on.
    pub drive: Option<(PinId, PinLevel)>,
}

/// A device on the I2C bus that has every address.
#[derive(Debug, Clone, Default)]
struct I2cDevice {
    data_low: bool,
    clock_low: bool,
    /// The bytes since each start of this transfer, with those that the device sent; `None` between
    /// transfers.
    segments: Option<Vec<Vec<u8>>>,
    /// Bits of the current byte, and how many there are; the ninth is the acknowledge.
    bits: (u8, u8),
    /// The device sends this byte.
    sends: bool,
}

/// A device on the SPI bus in mode 0.
#[derive(Debug, Clone, Default)]
struct SpiDevice {
    selected: bool,
    out_high: bool,
    bits: (u8, u8),
}

impl BusDevices {
    /// The devices of buses at rest; `None` if the program uses no bus.
    pub(crate) fn new(pins: BusPins) -> Option<BusDevices> {
        pins.pins().next()?;
        Some(BusDevices {
            pins,
            i2c: I2cDevice::default(),
            spi: SpiDevice::default(),
            answer: 0xFF,
            events: Vec::new(),
            fault: None,
            drive: None,
        })
    }

    /// At the start of a scan: chooses the byte that the devices answer in it.
    pub(crate) fn choose_answer(&mut self, eval: &mut Evaluator) {
        self.answer = (eval.scans() as u8).wrapping_mul(0x9D) ^ 0x5A;
        eval.set_bus_answer(self.answer);
    }

    /// At the end of a scan: compares what happened with what the evaluator did in it. Returns the number of
    /// values compared.
    pub(crate) fn compare(&mut self, eval: &Evaluator) -> Result<u64, Deviation> {
        let (wanted, found) = (eval.bus_events(), std::mem::take(&mut self.events));
        let text = |event: Option<&BusEvent>| event.map_or_else(|| "no transfer".to_owned(), event_text);
        if let Some(fault) = self.fault.take() {
            return Err(Deviation::new(text(wanted.get(found.len())), fault));
        }
        for n in 0..wanted.len().max(found.len()) {
            if wanted.get(n) != found.get(n) {
                return Err(Deviation::new(text(wanted.get(n)), text(found.get(n))));
            }
        }
        Ok(wanted.len() as u64 + 1)
    }

    /// Notes that a pin changed its level.
    pub(crate) fn note_edge(&mut self, pin: PinId, high: bool) {
        match (self.pins.i2c, self.pins.spi) {
            (Some((data, _)), _) if data == pin => self.on_i2c_data(high),
            (Some((data, clock)), _) if clock == pin => self.on_i2c_clock(high, data),
            (_, Some([select, _, _, data_in])) if select == pin => self.on_spi_select(!high, data_in),
            (_, Some([_, clock, _, data_in])) if clock == pin && high => self.on_spi_clock(data_in),
            (_, Some([_, _, out, _])) if out == pin => self.spi.out_high = high,
            _ => {}
        }
    }

    /// Keeps the first fault of the program on the bus.
    fn note_fault(&mut self, what: String) {
        self.fault.get_or_insert(what);
    }

    /// With the clock high, a change of the data line is a start or a stop.
    fn on_i2c_data(&mut self, high: bool) {
        let device = &mut self.i2c;
        if device.data_low != high {
            return;
        }
        device.data_low = !high;
        if device.clock_low {
            return;
        }
        device.bits = (0, 0);
        device.sends = false;
        if !high {
            device.segments.get_or_insert_default().push(Vec::new());
        } else if let Some(segments) = device.segments.take() {
            match i2c_event(&segments, self.answer) {
                Some(event) => self.events.push(event),
                None => self.note_fault(format!("an I2C transfer of {segments:02X?}")),
            }
        }
    }

    fn on_i2c_clock(&mut self, high: bool, data: PinId) {
        let answer = self.answer;
        let device = &mut self.i2c;
        if device.clock_low != high {
            return;
        }
        device.clock_low = !high;
        let Some(segment) = device.segments.as_mut().and_then(|all| all.last_mut()) else { return };
        let (byte, count) = device.bits;
        if high {
            if count < 8 {
                device.bits = (byte << 1 | u8::from(!device.data_low), count + 1);
            } else {
                // A master that wants no more bytes does not acknowledge.
                device.sends &= device.data_low;
                device.bits.1 = 9;
            }
            return;
        }
        let level = match (count, device.sends) {
            (8, sends) => {
                segment.push(byte);
                if sends { PinLevel::PullUp } else { PinLevel::Low }
            }
            (9, sends) => {
                device.bits = (0, 0);
                // The first byte after a start says who sends the others.
                device.sends = sends || segment.len() == 1 && segment[0] & 1 == 1;
                if device.sends { bit_level(answer, 0) } else { PinLevel::PullUp }
            }
            (_, true) => bit_level(answer, count),
            (_, false) => return,
        };
        self.drive = Some((data, level));
    }

    fn on_spi_select(&mut self, selected: bool, data_in: PinId) {
        if self.spi.selected == selected {
            return;
        }
        self.spi.selected = selected;
        let (byte, count) = std::mem::take(&mut self.spi.bits);
        if selected {
            self.drive = Some((data_in, PinLevel::from_bit(self.answer & 0x80 != 0)));
            return;
        }
        self.drive = Some((data_in, PinLevel::PullUp));
        match count {
            8 => self.events.push(BusEvent::Spi { byte }),
            bits => self.note_fault(format!("{bits} bits on the SPI bus")),
        }
    }

    /// The rising edge takes a bit of both sides. The next bit follows at once, since the falling edge may be
    /// only two clocks before the next rising one.
    fn on_spi_clock(&mut self, data_in: PinId) {
        if !self.spi.selected {
            return self.note_fault("a clock of the SPI bus while no device is selected".to_owned());
        }
        let (byte, count) = self.spi.bits;
        self.spi.bits = (byte << 1 | u8::from(self.spi.out_high), count.saturating_add(1));
        if count < 7 {
            let high = self.answer << (count + 1) & 0x80 != 0;
            self.drive = Some((data_in, PinLevel::from_bit(high)));
        }
    }
}

/// What an I2C device does to its line for bit `number` of a byte, from the highest one.
fn bit_level(byte: u8, number: u8) -> PinLevel {
    if byte << number & 0x80 == 0 { PinLevel::Low } else { PinLevel::PullUp }
}

/// The event that a whole transfer makes; `None` if it is none of an element.
fn i2c_event(segments: &[Vec<u8>], answer: u8) -> Option<BusEvent> {
    match segments.iter().map(Vec::as_slice).collect::<Vec<_>>()[..] {
        [[address, register, byte]] if address & 1 == 0 => {
            Some(BusEvent::I2cWrite { device: address >> 1, register: *register, byte: *byte })
        }
        [[address, register], [again, byte]] if address & 1 == 0 && *again == address | 1 && *byte == answer => {
            Some(BusEvent::I2cRead { device: address >> 1, register: *register })
        }
        _ => None,
    }
}

/// An event as text.
pub(crate) fn event_text(event: &BusEvent) -> String {
    match *event {
        BusEvent::I2cWrite { device, register, byte } => {
            format!("0x{byte:02X} written to register 0x{register:02X} of I2C device 0x{device:02X}")
        }
        BusEvent::I2cRead { device, register } => {
            format!("register 0x{register:02X} of I2C device 0x{device:02X} read")
        }
        BusEvent::Spi { byte } => format!("0x{byte:02X} sent on SPI"),
    }
}
