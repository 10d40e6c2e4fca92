//! SPI, SPI_WR, I2C_RD and I2C_WR: model, reader, text and checks.

use crate::check::Checker;
use crate::codes;
use crate::element_facts::ChipPart;
use crate::element_reader::{read_destination, read_operand, read_operand_in_range};
use crate::lexer::LdToken;
use crate::model::{Element, LadderOperand, ProgramElement};
use crate::reader::{LdReader, message_text};
use crate::write::operand_text;

/// Which bus, and what is done there, by LDmicro's keyword.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BusOp {
    /// `SPI`: sends a byte and receives one.
    Spi,
    /// `SPI_WR`: sends the bytes of a text.
    SpiText,
    /// `I2C_RD`: reads a register of a device.
    I2cRead,
    /// `I2C_WR`: writes a register of a device.
    I2cWrite,
}

impl BusOp {
    /// Keyword in `.ld` text.
    #[must_use]
    pub const fn keyword(self) -> &'static str {
        match self {
            BusOp::Spi => "SPI",
            BusOp::SpiText => "SPI_WR",
            BusOp::I2cRead => "I2C_RD",
            BusOp::I2cWrite => "I2C_WR",
        }
    }

    /// True for the two-wire bus.
    #[must_use]
    pub const fn is_i2c(self) -> bool {
        matches!(self, BusOp::I2cRead | BusOp::I2cWrite)
    }

    /// Returns the part of the chip that the element uses.
    pub(crate) const fn part(self) -> ChipPart {
        if self.is_i2c() { ChipPart::I2c } else { ChipPart::Spi }
    }
}

/// The arguments of one of these elements, in the order of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusTransfer {
    /// What is done.
    pub op: BusOp,
    /// Name of the bus, which says nothing here: a chip has one of each kind.
    pub name: String,
    /// What is sent: its low byte; `None` for `-` and for a text.
    pub send: Option<LadderOperand>,
    /// The text of SPI_WR; empty for the others.
    pub text: String,
    /// Variable that receives a byte; `None` for `-`.
    pub recv: Option<String>,
    /// `Master`, the only one that is supported.
    pub mode: String,
    /// Address of the device, 0 to 127; of an SPI bus the clock mode, of which 0 is supported.
    pub device: LadderOperand,
    /// Register of the device: its low byte; of an SPI bus the number of bits, of which 8 is supported.
    pub register: LadderOperand,
    /// Which bit goes first: `MSB..`, the only one that is supported.
    pub first: String,
    /// Rate in bits per second; 0 leaves the choice to the compiler.
    pub hertz: u32,
}

impl BusTransfer {
    /// The bytes of the text of SPI_WR, in the encoding of the file.
    #[must_use]
    pub fn text_bytes(&self) -> Vec<u8> {
        diag::text::encode_text(&self.text)
    }
}

/// Rate in bits per second of a bus whose elements name none.
const DEFAULT_HERTZ: u32 = 100_000;

/// The rate of a bus of the program: the lowest that its elements name.
#[must_use]
pub fn bus_hertz(program: &crate::LadderProgram, part: ChipPart) -> u32 {
    let rates = program.elements().filter_map(|ProgramElement { element, .. }| match element {
        Element::BusTransfer(transfer) if transfer.op.part() == part && transfer.hertz > 0 => Some(transfer.hertz),
        _ => None,
    });
    rates.min().unwrap_or(DEFAULT_HERTZ)
}

/// Reads one of these elements; its number of arguments is right.
pub(crate) fn read_bus_element(r: &mut LdReader<'_>, keyword: &'static str, args: &[LdToken<'_>]) -> Option<Element> {
    let [name, send, recv, mode, device, register, first, hertz] = *args else { return None };
    let op = match keyword {
        "SPI" => BusOp::Spi,
        "SPI_WR" => BusOp::SpiText,
        "I2C_RD" => BusOp::I2cRead,
        _ => BusOp::I2cWrite,
    };
    let (mut sent, mut text) = (Some(None), String::new());
    match op {
        BusOp::SpiText => text = send.text.to_owned(),
        BusOp::I2cRead => {}
        BusOp::Spi | BusOp::I2cWrite => sent = read_operand(r, keyword, send).map(Some),
    }
    let recv = match recv.text {
        "-" => Some(None),
        _ if matches!(op, BusOp::Spi | BusOp::I2cRead) => read_destination(r, keyword, recv).map(Some),
        _ => Some(None),
    };
    let (device, register) = match op.is_i2c() {
        true => (
            read_operand_in_range(r, keyword, device, "the address", 0, 127),
            read_operand_in_range(r, keyword, register, "the register", 0, 255),
        ),
        false => (Some(spi_mode(device)), read_operand_in_range(r, keyword, register, "the number of bits", 0, 255)),
    };
    let hertz = r.read_u32(hertz, "the rate in bits per second", 0, 100_000_000);
    let (name, mode, first) = (name.text.to_owned(), mode.text.to_owned(), first.text.to_owned());
    Some(Element::BusTransfer(Box::new(BusTransfer {
        op,
        name,
        send: sent?,
        text,
        recv: recv?,
        mode,
        device: device?,
        register: register?,
        first,
        hertz: hertz?,
    })))
}

/// The clock mode of SPI, which LDmicro writes as two binary digits; 255 for any other text.
fn spi_mode(token: LdToken<'_>) -> LadderOperand {
    let digits = token.text.strip_prefix("0b").unwrap_or(token.text);
    let value = match digits {
        "0" | "00" => 0,
        "1" | "01" => 1,
        "2" | "10" => 2,
        "3" | "11" => 3,
        _ => 255,
    };
    LadderOperand::Const { value, text: token.text.to_owned() }
}

/// Text of one of these elements as in a file.
pub(crate) fn bus_element_text(transfer: &BusTransfer) -> String {
    let BusTransfer { op, name, send, text, recv, mode, device, register, first, hertz } = transfer;
    let send = match (op, send) {
        (BusOp::SpiText, _) => text,
        (_, Some(send)) => operand_text(send),
        (_, None) => "-",
    };
    let recv = recv.as_deref().unwrap_or("-");
    let [device, register] = [device, register].map(operand_text);
    format!("{} {name} {send} {recv} {mode} {device} {register} {first} {hertz}", op.keyword())
}

/// Formats the transfer for the lower line of the drawing; the upper line is the keyword.
pub(crate) fn transfer_text(transfer: &BusTransfer) -> String {
    let BusTransfer { op, send, text, recv, device, register, .. } = transfer;
    let place = format!("{}.{}", operand_text(device), operand_text(register));
    let recv = recv.as_deref().unwrap_or("-");
    match op {
        BusOp::I2cRead => format!("{recv} := {place}"),
        BusOp::I2cWrite => format!("{place} := {}", send.as_ref().map_or("-", operand_text)),
        BusOp::SpiText => text.clone(),
        BusOp::Spi => format!("{recv} := {}", send.as_ref().map_or("-", operand_text)),
    }
}

/// Checks the arguments that are the same in every supported element.
pub(crate) fn check_bus_element(checker: &mut Checker<'_>, at: ProgramElement<'_>, transfer: &BusTransfer) {
    let is = |operand: &LadderOperand, wanted: i64| matches!(operand, LadderOperand::Const { value, .. } if *value == wanted);
    let mut refuse = |cause: String, hint: &str| checker.error(codes::ARGUMENT_LDMICRO5, at, cause, hint);
    if transfer.mode != "Master" {
        let cause = format!("the chip is the master of its bus here, found {}", message_text(&transfer.mode));
        refuse(cause, "write Master: a slave waits for another chip, and a scan has a fixed time");
    }
    if !transfer.first.starts_with("MSB") {
        let cause = format!("the first bit is the highest here, found {}", message_text(&transfer.first));
        refuse(cause, "write MSB_FIRST, and turn the byte with OPPOSITE if the device wants the lowest bit first");
    }
    if transfer.op.is_i2c() {
        if let LadderOperand::Var(name) = &transfer.device {
            refuse(format!("the address of the device is the variable {name}"), "write it as a number, 0 to 127");
        }
    } else {
        if !is(&transfer.device, 0) {
            let cause = format!("the clock mode is {}", message_text(operand_text(&transfer.device)));
            refuse(
                cause,
                "write 0b00, the only mode that LDmicro's own library has: SCK rests low, the rising edge samples",
            );
        }
        if !is(&transfer.register, 8) {
            let cause = format!("a transfer has {} bits", message_text(operand_text(&transfer.register)));
            refuse(cause, "write 8, and send longer numbers byte by byte: SR0 by 8 gives the next one");
        }
    }
    if transfer.op == BusOp::I2cRead && transfer.recv.is_none() {
        refuse("nothing receives the byte".to_owned(), "name a variable in place of the `-`");
    }
}
