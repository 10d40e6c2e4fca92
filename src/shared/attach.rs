//! `--attach`: devices on the pins of the chip, and the files that hold their contents.

use emu_avr::chips::unit_index;
use emu_avr::periph;
use emu_core::chip::{Chip, ChipFamily};
use emu_core::pins::PinId;
use emu_debug::devices::ExternalDevice;
use emu_debug::devices::eeprom24::Eeprom24;
use emu_debug::devices::flash25::Flash25;
use emu_debug::stimulus::{ExternalDrive, find_pin};
use emu_debug::{AttachedDevices, CycleClock, TimedDrive, WiredDevice, address_names};
use emu_pic16::periph::map::Pic16Line;

use crate::shared::avr;
use crate::shared::fail::VerbFailure;
use crate::shared::store::MemoryFile;
use diag::nearest;

use crate::shared::usage_error::UsageError;

/// The default address of an I2C device: A0 to A2 tied low.
const ADDRESS: u8 = 0x50;

/// The bus that connects a device to the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum AttachBus {
    I2c,
    Spi,
}

impl AttachBus {
    /// Names of the device's wires, in the order of its pins. A wire with an empty name has no setting on the
    /// command line.
    fn wires(self) -> &'static [&'static str] {
        match self {
            AttachBus::I2c => &["sda", "scl", "", "", "", "wp"],
            AttachBus::Spi => &["cs", "sck", "mosi", "miso"],
        }
    }

    /// Returns the default pin of a wire: the pin of the chip's own I2C or SPI interface.
    fn default_pin(self, chip: &Chip, wire: &str) -> Option<PinId> {
        let (unit, avr, pic16) = match (self, wire) {
            (AttachBus::I2c, "sda") => (unit_index::TWI, periph::AvrLine::Sda, Pic16Line::Sdi),
            (AttachBus::I2c, "scl") => (unit_index::TWI, periph::AvrLine::Scl, Pic16Line::Sck),
            (AttachBus::Spi, "sck") => (unit_index::SPI, periph::AvrLine::Sck, Pic16Line::Sck),
            (AttachBus::Spi, "mosi") => (unit_index::SPI, periph::AvrLine::Mosi, Pic16Line::Sdo),
            (AttachBus::Spi, "miso") => (unit_index::SPI, periph::AvrLine::Miso, Pic16Line::Sdi),
            _ => return None,
        };
        match chip.family {
            ChipFamily::Avr => {
                let lines = emu_avr::chips::part(chip.name)?.peripheral_pins;
                lines.iter().find(|row| (row.0, row.1) == (unit, avr)).map(|row| row.2)
            }
            ChipFamily::Pic16 => emu_pic16::chips::part(chip.name)?.line(pic16).map(|line| line.pin),
            ChipFamily::Mcs51 | ChipFamily::Ap101 => None,
        }
    }
}

/// A device as `--attach` describes it.
#[derive(Debug, Clone)]
pub struct AttachedDevice {
    text: String,
    bus: AttachBus,
    device: ExternalDevice,
    /// The file that holds the device's contents.
    pub file: Option<String>,
    /// Wires by their index in [`AttachBus::wires`], with the pins as typed.
    pins: Vec<(usize, String)>,
}

/// Parses `i2c:24c64@0x50,file=x.bin` or `spi:25q32,cs=PB2`.
pub fn parse_attach(text: &str) -> Result<AttachedDevice, UsageError> {
    let expected = "write i2c:24c64@0x50,file=data.bin or spi:25q32,cs=PB2,file=data.bin";
    let (head, rest) = text.split_once(',').unwrap_or((text, ""));
    let (bus, device) = head.split_once(':').ok_or_else(|| UsageError::malformed(expected))?;
    let (bus, device) = match bus {
        "i2c" | "twi" => (AttachBus::I2c, parse_i2c(device)?),
        "spi" => (AttachBus::Spi, parse_spi(device)?),
        _ => {
            return Err(UsageError::UnknownName {
                kind: "bus ",
                name: bus.to_owned(),
                expected: format!("; {expected}"),
            });
        }
    };
    let mut attached = AttachedDevice { text: text.to_owned(), bus, device, file: None, pins: Vec::new() };
    for setting in rest.split(',').filter(|setting| !setting.is_empty()) {
        let pair = setting.split_once('=');
        let (key, value) = pair.ok_or_else(|| UsageError::NoValue { setting: setting.to_owned(), expected })?;
        let wire = bus.wires().iter().position(|wire| *wire == key && !key.is_empty());
        let twice = match wire {
            Some(wire) => attached.pins.iter().any(|pin| pin.0 == wire),
            None => key == "file" && attached.file.is_some(),
        };
        match (key, wire) {
            _ if twice => return Err(UsageError::GivenTwice { key: key.to_owned() }),
            (_, Some(wire)) => attached.pins.push((wire, value.to_owned())),
            ("file", None) if value.is_empty() => return Err(UsageError::malformed("file= needs the name of a file")),
            ("file", None) => attached.file = Some(value.to_owned()),
            _ => {
                let keys: Vec<&str> = bus.wires().iter().copied().filter(|wire| !wire.is_empty()).collect();
                let expected = format!(" here; there are file, {}", keys.join(", "));
                return Err(UsageError::UnknownName { kind: "", name: key.to_owned(), expected });
            }
        }
    }
    Ok(attached)
}

fn unknown_device(name: &str, names: Vec<&'static str>) -> UsageError {
    let expected = match nearest(&name.to_ascii_lowercase(), names.iter().copied()) {
        Some(near) => format!("; did you mean `{near}`?"),
        None => format!("; there are {}", names.join(", ")),
    };
    UsageError::UnknownName { kind: "model of ", name: name.to_owned(), expected }
}

fn parse_i2c(text: &str) -> Result<ExternalDevice, UsageError> {
    let (name, address) = text.split_once('@').map_or((text, None), |(name, address)| (name, Some(address)));
    let mut eeprom = Eeprom24::new(name).ok_or_else(|| unknown_device(name, Eeprom24::names().collect()))?;
    let typed = address.unwrap_or("0x50");
    let address = address
        .map_or(Some(u32::from(ADDRESS)), address_names::parse_number)
        .and_then(|value| u8::try_from(value).ok());
    match address {
        Some(address) if eeprom.tie_address(address) => Ok(ExternalDevice::Eeprom(eeprom)),
        _ => Err(UsageError::DeviceAddress { device: name.to_owned(), address: typed.to_owned() }),
    }
}

fn parse_spi(name: &str) -> Result<ExternalDevice, UsageError> {
    Flash25::new(name).map(ExternalDevice::Flash).ok_or_else(|| unknown_device(name, Flash25::names().collect()))
}

/// Attached devices, and the files of those that have one. Files refer to devices by index.
pub struct AttachedStores {
    devices: Vec<WiredDevice>,
    stores: Vec<(usize, MemoryFile)>,
}

impl AttachedStores {
    /// Connects the devices to the pins of `chip` and fills them from their files.
    ///
    /// `reset` is the pin that resets the chip; it cannot be a bus line.
    pub fn new(list: &[AttachedDevice], chip: &Chip, reset: Option<PinId>) -> Result<AttachedStores, VerbFailure> {
        let mut stores = AttachedStores { devices: Vec::new(), stores: Vec::new() };
        for attached in list {
            let refuse = |why: String| VerbFailure::invalid_flag_value("--attach <DEVICE>", &attached.text, &why);
            let wires = wires(attached, chip).map_err(refuse)?;
            if let Some(pin) = reset.filter(|pin| wires.contains(&Some(*pin))) {
                return Err(refuse(format!("{} is the reset pin, no line of a bus", pin_name(chip, pin))));
            }
            let wired = WiredDevice { device: attached.device.clone(), wires };
            for (other, other_wired) in list.iter().zip(&stores.devices) {
                conflict(chip, (attached, &wired), (other, other_wired)).map_or(Ok(()), |why| Err(refuse(why)))?;
            }
            stores.devices.push(wired);
        }
        for (at, (attached, wired)) in list.iter().zip(&mut stores.devices).enumerate() {
            if let Some(file) = &attached.file {
                let (file, contents) = MemoryFile::open("--attach", file, wired.device.cells().len())?;
                wired.device.cells_mut().fill(&contents.unwrap_or_default());
                stores.stores.push((at, file));
            }
        }
        Ok(stores)
    }

    /// Builds the set of attached devices for a chip whose cycles have the length that `clock` gives. Refuses
    /// drives of pins that a device drives.
    pub fn connect(
        &self,
        chip: &Chip,
        clock: CycleClock,
        drives: &[TimedDrive],
    ) -> Result<AttachedDevices, VerbFailure> {
        let devices = AttachedDevices::new(self.devices.clone(), clock);
        let is_driven_by_device = |drive: &&TimedDrive| match drive.drive {
            ExternalDrive::Level(pin, _) | ExternalDrive::Volts(pin, _) | ExternalDrive::Counts(pin, _) => {
                devices.driven_pins().any(|driven| driven == pin)
            }
            ExternalDrive::Supply(_) => false,
        };
        match drives.iter().find(is_driven_by_device).map(|drive| drive.drive) {
            Some(ExternalDrive::Level(pin, _) | ExternalDrive::Volts(pin, _) | ExternalDrive::Counts(pin, _)) => {
                let name = pin_name(chip, pin);
                Err(VerbFailure::Usage(format!(
                    "{name} is driven by a device of --attach, so --set and --at cannot drive it"
                )))
            }
            _ => Ok(devices),
        }
    }

    /// Writes the contents of the devices into their files.
    pub fn write_back(self, devices: &AttachedDevices) -> Result<(), VerbFailure> {
        let devices: Vec<&ExternalDevice> = devices.devices().collect();
        for (at, file) in self.stores {
            if let Some(device) = devices.get(at) {
                file.keep(&device.cells().bytes())?;
            }
        }
        Ok(())
    }
}

/// Returns why two devices cannot be connected together: both answer to one address, or one pin has wires of
/// different kinds. Wires of one kind may share a pin, except those that select a device.
fn conflict(chip: &Chip, one: (&AttachedDevice, &WiredDevice), two: (&AttachedDevice, &WiredDevice)) -> Option<String> {
    let wires = |(attached, wired): (&AttachedDevice, &WiredDevice)| -> Vec<(PinId, &'static str)> {
        let named = wired.wires.iter().zip(attached.bus.wires());
        named.filter_map(|(pin, name)| Some(((*pin)?, *name))).collect()
    };
    let (first_wires, second_wires) = (wires(one), wires(two));
    let pairs = || first_wires.iter().flat_map(|own| second_wires.iter().map(move |other| (own, other)));
    let clash = pairs().find(|(own, other)| own.0 == other.0 && (own.1 != other.1 || own.1 == "cs"));
    if let Some(((pin, own), (_, other))) = clash {
        let name = pin_name(chip, *pin);
        return Some(match own == other {
            true => format!("{name} selects `{}` already", two.0.text),
            false => format!("{name} cannot be its {own}: it is the {other} of `{}`", two.0.text),
        });
    }
    let (ExternalDevice::Eeprom(own), ExternalDevice::Eeprom(other)) = (&one.1.device, &two.1.device) else {
        return None;
    };
    let bus = |wired: &WiredDevice| wired.wires.get(..2).map(<[_]>::to_vec);
    let both = (0..0x80).find(|&address| own.is_addressed_by(address) && other.is_addressed_by(address));
    let both = both.filter(|_| bus(one.1) == bus(two.1));
    both.map(|address| format!("`{}` answers to the address 0x{address:02x} already; @0x51 gives another", two.0.text))
}

fn pin_name(chip: &Chip, pin: PinId) -> &'static str {
    chip.pins.get(usize::from(pin)).map_or("?", |pin| pin.name)
}

/// Resolves the wires of a device to pins of the chip.
fn wires(attached: &AttachedDevice, chip: &Chip) -> Result<Vec<Option<PinId>>, String> {
    let bus = attached.bus;
    let wire = |(at, name): (usize, &&str)| {
        let named = attached.pins.iter().find(|(of, _)| *of == at);
        if let Some((_, typed)) = named {
            return Ok(Some(find_pin(chip, &avr::chip_pin_text(chip, typed))?));
        }
        let default_pin = bus.default_pin(chip, name);
        let needed = !matches!(*name, "" | "wp");
        match default_pin {
            None if needed => Err(format!("which pin is {name}? {name}=PIN says it")),
            _ => Ok(default_pin),
        }
    };
    let wires = bus.wires().iter().enumerate().map(wire).collect::<Result<Vec<_>, String>>()?;
    let mut pins: Vec<PinId> = wires.iter().copied().flatten().collect();
    pins.sort_unstable();
    match pins.windows(2).any(|two| two[0] == two[1]) {
        true => Err("two of its lines are at one pin".to_owned()),
        false => Ok(wires),
    }
}
