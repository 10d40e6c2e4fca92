//! Lowers SPI, SPI_WR, I2C_RD and I2C_WR.

use ladder::{BusOp, BusTransfer, ChipPart, LadderOperand};

use super::{Lowering, if_accumulator};
use crate::ir::{BusAction, IrOp, WordOperand};

impl Lowering<'_> {
    /// Notes which buses the program uses, and their rates.
    pub(super) fn set_up_buses(&mut self) {
        let rate = |part| self.program.uses_part(part).then(|| ladder::bus_hertz(self.program, part));
        (self.ir.buses.i2c, self.ir.buses.spi) = (rate(ChipPart::I2c), rate(ChipPart::Spi));
    }

    /// Lowers an element of a bus: it acts on a true rung, which it gives on.
    pub(super) fn bus_transfer(&mut self, transfer: &BusTransfer) {
        // The checks refuse an address that is no constant.
        let device = match transfer.device {
            LadderOperand::Const { value, .. } => (value & 127) as u8,
            LadderOperand::Var(_) => 0,
        };
        let nothing = WordOperand::Const(0);
        let value = transfer.send.as_ref().map_or(nothing, |send| self.value(send));
        let dst = transfer.recv.as_ref().map(|name| self.word(name));
        let register = if transfer.op.is_i2c() { self.value(&transfer.register) } else { nothing };
        let ops = match transfer.op {
            BusOp::I2cWrite => vec![IrOp::Transfer { action: BusAction::I2cWrite(device), register, value, dst: None }],
            BusOp::I2cRead => vec![IrOp::Transfer { action: BusAction::I2cRead(device), register, value, dst }],
            BusOp::Spi => vec![IrOp::Transfer { action: BusAction::Spi, register, value, dst }],
            BusOp::SpiText => {
                let byte = |byte: u8| WordOperand::Const(byte.into());
                let send = |of| IrOp::Transfer { action: BusAction::Spi, register, value: byte(of), dst: None };
                transfer.text_bytes().into_iter().map(send).collect()
            }
        };
        self.push(if_accumulator(ops));
    }
}
