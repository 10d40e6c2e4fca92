//! The machine of a command: its chip, how it is wired, and what is done at its pins from outside. `run` and `debug` share it.

use clap::Args;
use emu_core::chip::{Chip, Family};
use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::Image;
use emu_core::pins::{PinId, Time};
use emu_debug::stimulus::{Put, drive, lacking, put};
use emu_debug::text::unescape;
use emu_debug::{Clock, Drive, Sender, Source, time};

use crate::args::Mcu;
use crate::attach::{self, Attached, Bench};
use crate::fail::Failure;
use crate::family::{self, Setup};
use crate::readings;
use crate::store::{self, Store};
use crate::{ap101, avr, mcs51, pic16};

/// Flags of the machine.
#[derive(Debug, Args)]
pub struct MachineArgs {
    #[command(flatten)]
    pub mcu: Mcu,
    /// Oscillator: 16MHz, 32.768kHz, 8000000. Default: what the chip's row says (`emu chips --json`).
    #[arg(long, value_name = "HZ", value_parser = time::hertz)]
    pub clock: Option<u64>,
    /// Leave out the start-up times of the oscillator and the power-up timer, on AVR and PIC16: the first instruction runs in cycle
    /// 0.
    #[arg(long)]
    pub no_start_up: bool,
    /// Drive a pin from the start: PB0=1, P1.0=0, PB0=z (let go), RC3=pullup or pulldown (a resistor, which the chip
    /// overcomes); on AVR and PIC16 also to a voltage: RA0=1.25V, and VDD=4.5V or VCC=4.5V sets the supply. On AVR A0 is the
    /// pin of ADC0, and RESET the reset pin. Repeatable.
    #[arg(long, value_name = "PIN=LEVEL")]
    pub set: Vec<String>,
    /// Drive a pin from a time on: 10ms:PB0=0, 1000c:PB0=z; levels and voltages as in --set. Repeatable.
    #[arg(long, value_name = "TIME:PIN=LEVEL")]
    pub at: Vec<String>,
    /// Send bytes to the chip's first serial port from a time on: '10ms:hello\n' (escapes as in --expect-uart), as the edges that a
    /// sender of --baud makes at its receive pin. Repeatable.
    #[arg(long, value_name = "TIME:TEXT")]
    pub uart_in: Vec<String>,
    /// Bits per second of --uart-in; 8 bits, no parity, a stop bit. It is not the chip's: a wrong one is received wrong.
    #[arg(long, value_name = "RATE", default_value = "9600", requires = "uart_in", value_parser = baud)]
    pub baud: u64,
    /// Names for addresses: for the 8051 family a .map, .cdb or .rst file of SDCC or a .m51 of Keil, for the PIC16 family a
    /// .cod, .lst or .map file of gputils. Repeatable.
    #[arg(long, value_name = "FILE")]
    pub symbols: Vec<String>,
    /// What the EEPROM holds: read before the run, where the file exists, and written back after it, however it ends (`emu debug`
    /// writes nothing back). Intel HEX from address 0 on where the name ends in .hex or .eep, else plain bytes.
    #[arg(long, value_name = "FILE")]
    pub eeprom: Option<String>,
    /// Put a device at the pins of the chip: i2c:24c64@0x50 (24c01 to 24c1024, with resistors at SDA and SCL) or spi:25q32,cs=PB2
    /// (25q80 to 25q128). With ,file=NAME it holds what the file holds, which is written back as with --eeprom. Pins are those
    /// of the chip's interface, or ,sda=PIN,scl=PIN,wp=PIN and ,sck=PIN,mosi=PIN,miso=PIN. Repeatable.
    #[arg(long, value_name = "DEVICE", value_parser = attach::attached)]
    pub attach: Vec<Attached>,
    #[command(flatten)]
    readings: readings::Args,
    #[command(flatten)]
    avr: avr::Flags,
    #[command(flatten)]
    mcs51: mcs51::Flags,
    #[command(flatten)]
    pic16: pic16::Flags,
    #[command(flatten)]
    ap101: ap101::Flags,
}

fn baud(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| "write a whole number of bits per second, as 9600".to_owned())
}

/// What a command decides about its machine beside the flags.
pub struct How {
    /// What RAM holds after power-up.
    pub ram: RamInit,
    /// The pins of an external bus are looked at.
    pub bus: bool,
    /// The oscillator, where one is asked for.
    pub clock: Option<u64>,
    /// Start-up times are taken.
    pub start_up: bool,
}

/// How the machine is built, what its image holds, and what stands around it.
pub struct Wired {
    /// The program.
    pub image: Image,
    /// How the machine is built.
    pub setup: Setup,
    /// Oscillator, in Hz.
    pub hz: u64,
    /// How an AVR is wired.
    pub avr: avr::Wiring,
    /// The file of the EEPROM, and what it holds.
    pub eeprom: Option<(Store, Option<Vec<u8>>)>,
    /// Devices at the pins.
    pub bench: Bench,
}

impl MachineArgs {
    /// What the flags come to; they are looked at before the image is read, which `read` does. Notes are told.
    pub fn wired(
        &self,
        chip: &'static Chip,
        how: &How,
        read: impl FnOnce() -> Result<Image, Failure>,
    ) -> Result<Wired, Failure> {
        let asked = how.clock;
        if self.no_start_up && matches!(chip.family, Family::Mcs51 | Family::Ap101) {
            let why = format!("--no-start-up is for chips of the AVR and PIC16 families; {} is none", chip.name);
            return Err(Failure::Usage(why));
        }
        let readings = self.readings.of(chip)?;
        let mcs51 = self.mcs51.options(chip, readings.mcs51)?;
        let ap101 = self.ap101.options(chip, asked)?;
        let mut pic16 = self.pic16.options(chip, asked.unwrap_or(chip.default_hz), how.start_up)?;
        pic16.readings = readings.pic16;
        // Refused before the image is read, like the others.
        self.avr.wiring(chip, &Image::default(), asked, how.start_up)?;
        let image = read()?;
        let mut avr = self.avr.wiring(chip, &image, asked, how.start_up)?;
        avr.options.readings = readings.avr;
        let hz = ap101::hz(chip, &image, &ap101).unwrap_or(avr.options.hz);
        if hz > chip.max_hz {
            let why = format!("{} runs at up to {} Hz", chip.name, chip.max_hz);
            return Err(Failure::value("--clock <HZ>", &hz.to_string(), &why));
        }
        let eeprom = self.eeprom.as_deref().map(|file| store::eeprom(file, chip, &image)).transpose()?;
        let bench = Bench::new(&self.attach, chip, avr::reset_pin(chip, &avr))?;
        mcs51::warn(chip, &image, &mcs51);
        avr::tell(chip, &avr, asked);
        let setup = Setup { ram: how.ram, bus: how.bus, avr: avr.options, mcs51, pic16, ap101 };
        Ok(Wired { image, setup, hz, avr, eeprom, bench })
    }

    /// What is done at the pins from outside; `alias` gives `PIN=LEVEL` for `NAME=LEVEL`, where a program has names for pins.
    pub fn drives(
        &self,
        source: &Source<'_>,
        clock: Clock,
        alias: &dyn Fn(&str) -> String,
    ) -> Result<Vec<Drive>, Failure> {
        let (names, chip) = (&source.names, source.names.chip);
        let mut drives = Vec::new();
        for text in &self.set {
            let put = put(chip, &avr::own_name(chip, &names.with_channel(&alias(text))))
                .map_err(|why| Failure::value("--set <PIN=LEVEL>", text, &why))?;
            drives.push(Drive { at: Time::default(), put });
        }
        for text in &self.at {
            let own = text
                .split_once(':')
                .map(|(time, put)| format!("{time}:{}", avr::own_name(chip, &names.with_channel(&alias(put)))));
            let own = own.as_deref().unwrap_or(text);
            drives.push(drive(chip, clock, own).map_err(|why| Failure::value("--at <TIME:PIN=LEVEL>", text, &why))?);
        }
        let incoming = self.incoming(chip, clock, &drives)?;
        drives.extend(incoming);
        Ok(drives)
    }

    /// What `--uart-in` does at the receive pin, which none of the `others` drives.
    fn incoming(&self, chip: &Chip, clock: Clock, others: &[Drive]) -> Result<Vec<Drive>, Failure> {
        if self.uart_in.is_empty() {
            return Ok(Vec::new());
        }
        let text = |typed: &String| -> Result<(Time, Vec<u8>), String> {
            let (time, text) =
                typed.split_once(':').ok_or_else(|| format!("`{typed}` gives no time; write 10ms:{typed}"))?;
            Ok((clock.moment(time)?, unescape(text)?))
        };
        let text = |typed: &String| text(typed).map_err(|why| Failure::value("--uart-in <TIME:TEXT>", typed, &why));
        let texts = self.uart_in.iter().map(text).collect::<Result<Vec<_>, _>>()?;
        let pin = family::receive_pin(chip).ok_or_else(|| {
            Failure::Usage(format!("--uart-in is for chips with a serial port; {} has none", chip.name))
        })?;
        let drives =
            |drive: &Drive| matches!(drive.put, Put::Level(driven, _) | Put::Volts(driven, _) if driven == pin);
        if others.iter().any(drives) {
            let name = chip.pins.get(usize::from(pin)).map_or("?", |pin| pin.name);
            return Err(Failure::Usage(format!("{name} is driven by --uart-in, so --set and --at cannot drive it")));
        }
        let baud = |why: String| Failure::value("--baud <RATE>", &self.baud.to_string(), &why);
        let sender = Sender::new(pin, self.baud).map_err(baud)?;
        sender.edges(clock, &texts).map_err(Failure::Usage)
    }
}

/// Refuses pins that the machine does not have because its image or `--package` says so: those that are driven, and the `others`.
pub fn there<C: Cpu>(cpu: &C, drives: &[Drive], others: impl Iterator<Item = PinId>) -> Result<(), Failure> {
    let driven = drives.iter().filter_map(|drive| match drive.put {
        Put::Level(pin, _) | Put::Volts(pin, _) | Put::Counts(pin, _) => Some(pin),
        Put::Supply(_) => None,
    });
    match driven.chain(others).find(|pin| !cpu.has_pin(*pin)) {
        None => Ok(()),
        Some(pin) => Err(Failure::Usage(lacking(cpu.chip(), pin))),
    }
}
