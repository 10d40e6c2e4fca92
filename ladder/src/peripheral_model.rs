//! Arguments of the elements that use a part of the chip, and the PWM outputs of a program.

use crate::model::{Element, ElementId, LadderOperand, LadderProgram, ProgramElement};

/// The output that SET_PWM names, and its resolution (LDmicro 5).
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct PwmChoice {
    /// Name of the output, which `IO LIST` puts at a pin.
    pub name: String,
    /// The resolution as written; empty if missing.
    pub resolution: String,
}

/// How many bytes UART_SEND or UART_RECV transfers, and whether it waits for the end (LDmicro 5).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SerialTransfer {
    /// Number of bytes.
    pub bytes: u32,
    /// 0 for one byte at most in a scan, another number for all in one scan.
    pub wait: u32,
}

impl SerialTransfer {
    /// True for an UART_RECV that stops the program until all of its bytes have come. LDmicro 5 ignores the
    /// flag for a single byte.
    #[must_use]
    pub fn holds_scan(&self) -> bool {
        self.bytes > 1 && self.wait != 0
    }
}

impl Default for SerialTransfer {
    fn default() -> SerialTransfer {
        SerialTransfer { bytes: 1, wait: 0 }
    }
}

/// A PWM output of a program: that of all SET_PWM with one name, or of those without a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PwmOutput {
    /// Name of the output, if SET_PWM has one.
    pub name: Option<String>,
    /// Frequency in Hz; `None` if it is refused.
    pub hertz: Option<u32>,
    /// The first SET_PWM of the output.
    pub element: ElementId,
}

impl PwmOutput {
    /// The name, or `PWM` for the output without one.
    #[must_use]
    pub fn label(&self) -> &str {
        self.name.as_deref().unwrap_or("PWM")
    }
}

impl LadderProgram {
    /// The PWM outputs in the order in which SET_PWM names them first.
    #[must_use]
    pub fn pwm_outputs(&self) -> Vec<PwmOutput> {
        let mut outputs: Vec<PwmOutput> = Vec::new();
        for ProgramElement { id, element, .. } in self.elements() {
            let Element::SetPwm { hertz, output, .. } = element else { continue };
            let name = output.as_ref().map(|choice| choice.name.clone());
            if outputs.iter().all(|output| output.name != name) {
                let hertz = match hertz {
                    LadderOperand::Const { value, .. } => u32::try_from(*value).ok().filter(|hertz| *hertz > 0),
                    LadderOperand::Var(_) => None,
                };
                outputs.push(PwmOutput { name, hertz, element: id });
            }
        }
        outputs
    }
}
