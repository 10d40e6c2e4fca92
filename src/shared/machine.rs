//! The machine of a command: its chip, its options, and what drives its pins. `run` and `debug` share it.

use clap::Args;
use emu_core::chip::Chip;
use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::Image;
use emu_core::pins::{CycleTime, PinId};
use emu_debug::serial_sender::TimedText;
use emu_debug::stimulus::{ExternalDrive, missing_pin_reason, parse_drive, parse_timed_drive};
use emu_debug::text_escapes::unescape;
use emu_debug::{CycleClock, ProgramSource, SerialLineSender, TimedDrive, time};

use crate::shared::attach::{AttachedDevice, AttachedStores};
use crate::shared::fail::VerbFailure;
use crate::shared::family::MachineSetup;
use crate::shared::flags::McuFlags;
use crate::shared::store::MemoryFile;
use crate::shared::usage_error::UsageError;
use crate::shared::{ap101, attach, avr, family, mcs51, pic16, readings, store};

/// Flags that describe the machine.
#[derive(Debug, Args)]
pub struct MachineArgs {
    #[command(flatten)]
    pub mcu: McuFlags,
    /// Oscillator frequency: 16MHz, 32.768kHz, 8000000. Default: the frequency in the chip's row (`emu chips
    /// --json`).
    #[arg(long, value_name = "HZ", value_parser = time::parse_hertz)]
    pub clock: Option<u64>,
    /// Skip the start-up times of the oscillator and the power-up timer on AVR and PIC16: the first
    /// instruction runs in cycle 0.
    #[arg(long)]
    pub no_start_up: bool,
    /// Drive a pin from the start: PB0=1, P1.0=0, PB0=z (released), RC3=pullup or pulldown (a resistor, which
    /// the chip can overdrive). On AVR and PIC16 also to a voltage: RA0=1.25V; VDD=4.5V or VCC=4.5V sets the
    /// supply. On AVR A0 is the pin of ADC0, and RESET the reset pin. Repeatable.
    #[arg(long, value_name = "PIN=LEVEL")]
    pub set: Vec<String>,
    /// Drive a pin from a given time: 10ms:PB0=0, 1000c:PB0=z. Levels and voltages are as in --set.
    /// Repeatable.
    #[arg(long, value_name = "TIME:PIN=LEVEL")]
    pub at: Vec<String>,
    /// Send bytes to the chip's first serial port from a given time: '10ms:hello\n' (escapes as in
    /// --expect-uart). The receive pin sees the edges of a sender with the rate --baud. Repeatable.
    #[arg(long, value_name = "TIME:TEXT")]
    pub uart_in: Vec<String>,
    /// Bits per second of --uart-in, with 8 data bits, no parity and 1 stop bit. The chip has its own rate:
    /// if the two differ, it receives wrong bytes.
    #[arg(long, value_name = "RATE", default_value = "9600", requires = "uart_in", value_parser = parse_baud)]
    pub baud: u64,
    /// Symbol files: for the 8051 family a .map, .cdb or .rst file of SDCC or a .m51 of Keil, for the PIC16
    /// family a .cod, .lst or .map file of gputils. Repeatable.
    #[arg(long, value_name = "FILE")]
    pub symbols: Vec<String>,
    /// The file with the contents of the EEPROM. It is read before the run if it exists, and written after
    /// the run, however the run ends (`emu debug` never writes it). Intel HEX from address 0 if the name ends
    /// in .hex or .eep, otherwise plain bytes.
    #[arg(long, value_name = "FILE")]
    pub eeprom: Option<String>,
    /// Connect a device to the pins of the chip: i2c:24c64@0x50 (24c01 to 24c1024, with pull-up resistors on
    /// SDA and SCL) or spi:25q32,cs=PB2 (25q80 to 25q128). With ,file=NAME the device starts with the
    /// contents of the file, and writes them back as --eeprom does. The default pins are those of the chip's
    /// interface; ,sda=PIN,scl=PIN,wp=PIN and ,sck=PIN,mosi=PIN,miso=PIN choose others. Repeatable.
    #[arg(long, value_name = "DEVICE", value_parser = attach::parse_attach)]
    pub attach: Vec<AttachedDevice>,
    #[command(flatten)]
    readings: readings::ReadingFlags,
    #[command(flatten)]
    avr: avr::AvrFlags,
    #[command(flatten)]
    mcs51: mcs51::Mcs51Flags,
    #[command(flatten)]
    pic16: pic16::Pic16Flags,
    #[command(flatten)]
    ap101: ap101::Ap101Flags,
}

fn parse_baud(text: &str) -> Result<u64, UsageError> {
    text.parse().map_err(|_| UsageError::malformed("write a whole number of bits per second, as 9600"))
}

/// Settings that the command, not the user's flags, decides for its machine.
pub struct MachineOptions {
    /// The contents of RAM after power-up.
    pub ram: RamInit,
    /// Show the signals of the external bus on the pins (8051).
    pub bus: bool,
    /// The oscillator frequency in Hz, if requested.
    pub clock: Option<u64>,
    /// Include start-up times.
    pub start_up: bool,
}

/// The options of a machine, its image, and its attached devices.
pub struct WiredMachine {
    /// The program.
    pub image: Image,
    /// The options for building the machine.
    pub setup: MachineSetup,
    /// Oscillator frequency in Hz.
    pub hz: u64,
    /// Settings of an AVR.
    pub avr: avr::AvrWiring,
    /// The file of the EEPROM, and its contents if it exists.
    pub eeprom: Option<(MemoryFile, Option<Vec<u8>>)>,
    /// Devices on the pins.
    pub devices: AttachedStores,
}

impl MachineArgs {
    /// Turns the flags into a machine. The flags are checked before `read` reads the image. Prints notes.
    pub fn wire_machine(
        &self,
        chip: &'static Chip,
        options: &MachineOptions,
        read: impl FnOnce() -> Result<Image, VerbFailure>,
    ) -> Result<WiredMachine, VerbFailure> {
        let requested_hz = options.clock;
        if self.no_start_up && !chip.family_traits().has_start_up {
            let why = format!("--no-start-up is for chips of the AVR and PIC16 families; {} is not one", chip.name);
            return Err(VerbFailure::Usage(why));
        }
        let readings = self.readings.of(chip)?;
        let mcs51 = self.mcs51.options(chip, readings.mcs51)?;
        let ap101 = self.ap101.options(chip, requested_hz)?;
        let mut pic16 = self.pic16.options(chip, requested_hz.unwrap_or(chip.default_hz), options.start_up)?;
        pic16.readings = readings.pic16;
        // Check the flags before the image is read, like the others.
        self.avr.wiring(chip, &Image::default(), requested_hz, options.start_up)?;
        let image = read()?;
        let mut avr = self.avr.wiring(chip, &image, requested_hz, options.start_up)?;
        avr.options.readings = readings.avr;
        let hz = ap101::clock_hz(chip, &image, &ap101).unwrap_or(avr.options.hz);
        if hz > chip.max_hz {
            let why = format!("{} runs at up to {} Hz", chip.name, chip.max_hz);
            return Err(VerbFailure::invalid_flag_value("--clock <HZ>", &hz.to_string(), &why));
        }
        let eeprom = self.eeprom.as_deref().map(|file| store::open_eeprom_file(file, chip, &image)).transpose()?;
        let devices = AttachedStores::new(&self.attach, chip, avr::reset_pin(chip, &avr))?;
        mcs51::warn_external_memory(chip, &image, &mcs51);
        avr::report_fuse_clock(chip, &avr, requested_hz);
        let setup = MachineSetup { ram: options.ram, bus: options.bus, avr: avr.options, mcs51, pic16, ap101 };
        Ok(WiredMachine { image, setup, hz, avr, eeprom, devices })
    }

    /// Returns the drives of `--set`, `--at` and `--uart-in`. `alias` turns `NAME=LEVEL` into `PIN=LEVEL` for
    /// programs that name their pins.
    pub fn drives(
        &self,
        source: &ProgramSource<'_>,
        clock: CycleClock,
        alias: &dyn Fn(&str) -> String,
    ) -> Result<Vec<TimedDrive>, VerbFailure> {
        let (names, chip) = (&source.names, source.names.chip);
        let mut drives = Vec::new();
        for text in &self.set {
            let drive = parse_drive(chip, &avr::chip_pin_text(chip, &names.replace_channel_name(&alias(text))))
                .map_err(|why| VerbFailure::invalid_flag_value("--set <PIN=LEVEL>", text, &why))?;
            drives.push(TimedDrive { at: CycleTime::default(), drive });
        }
        for text in &self.at {
            let resolved = text.split_once(':').map(|(time, drive)| {
                format!("{time}:{}", avr::chip_pin_text(chip, &names.replace_channel_name(&alias(drive))))
            });
            let resolved = resolved.as_deref().unwrap_or(text);
            drives.push(
                parse_timed_drive(chip, clock, resolved)
                    .map_err(|why| VerbFailure::invalid_flag_value("--at <TIME:PIN=LEVEL>", text, &why))?,
            );
        }
        let incoming = self.serial_drives(chip, clock, &drives)?;
        drives.extend(incoming);
        Ok(drives)
    }

    /// Returns the edges of `--uart-in` at the receive pin. Refuses them if one of the `others` drives that
    /// pin.
    fn serial_drives(
        &self,
        chip: &Chip,
        clock: CycleClock,
        others: &[TimedDrive],
    ) -> Result<Vec<TimedDrive>, VerbFailure> {
        if self.uart_in.is_empty() {
            return Ok(Vec::new());
        }
        let text = |typed: &String| -> Result<TimedText, String> {
            let (time, text) =
                typed.split_once(':').ok_or_else(|| format!("`{typed}` gives no time; write 10ms:{typed}"))?;
            Ok(TimedText { at: clock.parse_moment(time)?, bytes: unescape(text)? })
        };
        let text = |typed: &String| {
            text(typed).map_err(|why| VerbFailure::invalid_flag_value("--uart-in <TIME:TEXT>", typed, &why))
        };
        let texts = self.uart_in.iter().map(text).collect::<Result<Vec<_>, _>>()?;
        let pin = family::receive_pin(chip).ok_or_else(|| {
            VerbFailure::Usage(format!("--uart-in is for chips with a serial port; {} has none", chip.name))
        })?;
        let drives = |drive: &TimedDrive| matches!(drive.drive, ExternalDrive::Level(driven, _) | ExternalDrive::Volts(driven, _) if driven == pin);
        if others.iter().any(drives) {
            let name = chip.pins.get(usize::from(pin)).map_or("?", |pin| pin.name);
            return Err(VerbFailure::Usage(format!(
                "{name} is driven by --uart-in, so --set and --at cannot drive it"
            )));
        }
        let sender = SerialLineSender::new(pin, self.baud)
            .map_err(|why| VerbFailure::invalid_flag_value("--baud <RATE>", &self.baud.to_string(), &why))?;
        sender.edges_of_texts(clock, &texts).map_err(VerbFailure::usage)
    }
}

/// Refuses pins that the machine does not have because of its image or `--package`: the driven pins and the
/// `others`.
pub fn check_pins_exist<C: Cpu>(
    cpu: &C,
    drives: &[TimedDrive],
    others: impl Iterator<Item = PinId>,
) -> Result<(), VerbFailure> {
    let driven = drives.iter().filter_map(|drive| match drive.drive {
        ExternalDrive::Level(pin, _) | ExternalDrive::Volts(pin, _) | ExternalDrive::Counts(pin, _) => Some(pin),
        ExternalDrive::Supply(_) => None,
    });
    match driven.chain(others).find(|pin| !cpu.has_pin(*pin)) {
        None => Ok(()),
        Some(pin) => Err(VerbFailure::usage(missing_pin_reason(cpu.chip(), pin))),
    }
}
