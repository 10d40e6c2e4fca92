//! Appearance of each element in a drawing: one line of text above the wire and one in it.

use crate::bus_elements;
use crate::model::{CompareOp, CounterKind, Element, FlowOp, LadderOperand, MathOp};
use crate::write;

/// The two lines of an element, which are drawn centred on each other.
pub(crate) struct ElementSymbol {
    /// The line above the wire.
    pub above: String,
    /// The line in the wire.
    pub in_wire: String,
}

/// Returns the lines of an element. Both are empty for a comment.
pub(crate) fn element_symbol(element: &Element) -> ElementSymbol {
    let (top, bottom) = match element {
        Element::Comment(_) => (String::new(), String::new()),
        Element::Contacts { name, negated, .. } => (name.clone(), if *negated { "]/[" } else { "] [" }.to_owned()),
        Element::Coil { name, negated, set, reset, ttrigger } => {
            let inner: String = [(*negated, '/'), (*set, 'S'), (*reset, 'R'), (*ttrigger == Some(1), 'T')]
                .iter()
                .filter(|(on, _)| *on)
                .map(|(_, c)| *c)
                .collect();
            (name.clone(), format!("({})", if inner.is_empty() { " " } else { &inner }))
        }
        Element::Short => (String::new(), "+------+".to_owned()),
        Element::Open => (String::new(), "+      +".to_owned()),
        Element::Placeholder => (String::new(), "??".to_owned()),
        Element::MasterRelay => (String::new(), "{MASTER RLY}".to_owned()),
        // The underscore above the wire completes the drawn edge.
        Element::Osr => ("       _ ".to_owned(), "[OSR _/ ]".to_owned()),
        Element::Osf => ("    _    ".to_owned(), "[OSF \\_ ]".to_owned()),
        Element::Odr => ("    _    ".to_owned(), "[ODR \\_/]".to_owned()),
        Element::Odf => ("    _    ".to_owned(), "[ODF \\_/]".to_owned()),
        Element::Osl => ("    _    ".to_owned(), "[OSL \\_/]".to_owned()),
        Element::Osc => ("    _ _  ".to_owned(), "[OSC_| |_]".to_owned()),
        Element::Timer { kind, name, delay, adjust } => {
            let adjust = match adjust {
                Some(LadderOperand::Const { value, .. }) if *value > 0 => format!(" +{value}"),
                Some(adjust) => format!(" {}", write::operand_text(adjust)),
                None => String::new(),
            };
            (name.clone(), format!("[{} {}{adjust}]", write::timer_keyword(*kind), duration(delay)))
        }
        Element::Counter { kind, name, max, init, input } => {
            let max = write::operand_text(max);
            let start = init.as_ref().map_or("0", write::operand_text);
            let input = input.map_or(String::new(), String::from);
            // What a CTU or CTD begins with is shown where it is not 0.
            let from = if start == "0" { String::new() } else { format!("{start}: ") };
            let symbol = match kind {
                CounterKind::Ctc => format!("{{{input}CTC {start}:{max}}}"),
                CounterKind::Ctr => format!("{{{input}CTR {max}:{start}}}"),
                CounterKind::Ctu | CounterKind::Ctd => {
                    format!("[{input}{} {from}>={max}]", write::counter_keyword(*kind))
                }
            };
            (name.clone(), symbol)
        }
        Element::Res { name } => (name.clone(), "{RES}".to_owned()),
        Element::Move { dest, src } => {
            in_brackets("{", &format!("{dest} :="), &format!("{} MOV", write::operand_text(src)), "}")
        }
        Element::Math { op, dest, op1, op2 } => {
            let sign = match op {
                MathOp::Add => '+',
                MathOp::Sub => '-',
                MathOp::Mul => '*',
                MathOp::Div => '/',
                MathOp::Mod => '%',
                MathOp::And => '&',
                MathOp::Or => '|',
                MathOp::Xor => '^',
            };
            let sum = format!("{} {sign} {}", write::operand_text(op1), write::operand_text(op2));
            in_brackets("{", &format!("{} {dest} :=", write::math_keyword(*op)), &sum, "}")
        }
        Element::Unary { op, dest, src } => {
            in_brackets("{", &format!("{} {dest} :=", write::unary_keyword(*op)), write::operand_text(src), "}")
        }
        Element::Shift { op, dest, src, count } => {
            let shifted = format!("{} by {}", write::operand_text(src), write::operand_text(count));
            in_brackets("{", &format!("{} {dest} :=", write::shift_keyword(*op)), &shifted, "}")
        }
        Element::Flow { op: FlowOp::Label, label } => (label.clone(), "[LABEL:]".to_owned()),
        Element::Flow { op, label } => (label.clone(), format!("{{{}}}", write::flow_keyword(*op))),
        Element::Segments { display, dest, src, common } => {
            let shown = format!("{} {common}", write::operand_text(src));
            in_brackets("{", &format!("{} {dest} :=", write::segments_keyword(*display)), &shown, "}")
        }
        Element::TimeValue { is_scans, dest, time } => {
            in_brackets("{", &format!("{} {dest} :=", write::time_value_keyword(*is_scans)), &duration(time), "}")
        }
        Element::Random { dest } => (dest.clone(), "{RANDOM}".to_owned()),
        Element::SeedRandom { dest, src } => {
            in_brackets("{", &format!("SEED {dest} :="), write::operand_text(src), "}")
        }
        Element::Delay { time } => (write::operand_text(time).to_owned(), "{DELAY}".to_owned()),
        Element::Sleep => (String::new(), "{SLEEP}".to_owned()),
        Element::ClearWatchdog => (String::new(), "{CLRWDT}".to_owned()),
        Element::Lock => (String::new(), "{LOCK}".to_owned()),
        Element::Return => (String::new(), "{RETURN}".to_owned()),
        Element::BitWrite { name, bit, value } => {
            in_brackets("{", write::bit_write_keyword(*value), &format!("{name}.{}", write::operand_text(bit)), "}")
        }
        Element::BitTest { name, bit, value } => {
            in_brackets("[", write::bit_test_keyword(*value), &format!("{name}.{}", write::operand_text(bit)), "]")
        }
        Element::Bus { dest, src, targets } => {
            let to: String = targets.iter().rev().map(u8::to_string).collect();
            in_brackets("{", &format!("BUS {dest} :="), &format!("{} to {to}", write::operand_text(src)), "}")
        }
        Element::Compare { op, op1, op2 } => {
            let sign = match op {
                CompareOp::Equ => "==",
                CompareOp::Neq => "/=",
                CompareOp::Grt => ">",
                CompareOp::Geq => ">=",
                CompareOp::Les => "<",
                CompareOp::Leq => "<=",
            };
            in_brackets("[", &format!("{} {sign}", write::operand_text(op1)), write::operand_text(op2), "]")
        }
        Element::ShiftRegister { name, stages } => {
            in_brackets("{", "SHIFT REG", &format!("{name}0..{}", stages.saturating_sub(1)), "}")
        }
        Element::LookUpTable { dest, index, .. } => {
            in_brackets("{", &format!("{dest} :="), &format!("LUT[{}]", write::operand_text(index)), "}")
        }
        Element::PiecewiseLinear { dest, index, .. } => {
            in_brackets("{", &format!("{dest} :="), &format!("PWL[{}]", write::operand_text(index)), "}")
        }
        Element::ReadAdc { name, .. } => (name.clone(), "{READ ADC}".to_owned()),
        Element::SetPwm { duty, hertz, output } => {
            let name = output.as_ref().map_or_else(String::new, |choice| format!("{} ", choice.name));
            (write::operand_text(duty).to_owned(), format!("{{PWM {name}{}}}", frequency(hertz)))
        }
        Element::UartRecv { name, .. } => (name.clone(), "{UART RECV}".to_owned()),
        Element::UartSend { name, .. } => (name.clone(), "{UART SEND}".to_owned()),
        Element::UartRecvAvail => (String::new(), "[UART AVAIL]".to_owned()),
        Element::UartSendReady => (String::new(), "[UART READY]".to_owned()),
        Element::Pulser { high, low, count, coil, .. } => {
            let [high, low, count] = [high, low, count].map(write::operand_text);
            in_brackets("[", &format!("PULSER {coil}"), &format!("{count} of {high}:{low}"), "]")
        }
        Element::Npulse { count, hertz, coil } => {
            let [count, hertz] = [count, hertz].map(write::operand_text);
            in_brackets("[", &format!("NPULSE {coil}"), &format!("{count} at {hertz} Hz"), "]")
        }
        Element::NpulseOff => (String::new(), "{NPULSE OFF}".to_owned()),
        Element::Stepper { name, max, period, coil, .. } => {
            let [max, period] = [max, period].map(write::operand_text);
            in_brackets("[", &format!("STEPPER {name} {coil}"), &format!("{max} every {period}"), "]")
        }
        Element::QuadEncod { counter, inputs: [a, b], .. } => {
            in_brackets("[", &format!("QUAD {counter}"), &format!("{a} {b}"), "]")
        }
        Element::BusTransfer(transfer) => {
            in_brackets("{", &transfer.op.keyword().replace('_', " "), &bus_elements::transfer_text(transfer), "}")
        }
        Element::Persist { name } => (name.clone(), "{PERSIST}".to_owned()),
        Element::Text { dest, text, .. } => (dest.clone().unwrap_or_default(), format!("{{STRING \"{text}\"}}")),
        Element::FormattedString { var, text, .. } => (var.clone().unwrap_or_default(), format!("{{\"{text}\"}}")),
        Element::Instruction(step) => (String::new(), step.to_string()),
    };
    ElementSymbol { above: printable(&top), in_wire: printable(&bottom) }
}

/// Puts two lines of equal width in brackets: the upper one left-aligned, the lower one centred.
fn in_brackets(left: &str, upper: &str, lower: &str, right: &str) -> (String, String) {
    let width = upper.chars().count().max(lower.chars().count() + 2);
    (format!("{left}{upper:<width$}{right}"), format!("{left}{lower:^width$}{right}"))
}

/// Replaces control characters, which would break the lines of the drawing, by dots.
pub(crate) fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '.' } else { c }).collect()
}

/// Formats a delay with its unit: `100 us`, `500.0 ms`, `1.000 s`.
fn duration(delay: &LadderOperand) -> String {
    match delay {
        LadderOperand::Var(name) => name.clone(),
        LadderOperand::Const { value, .. } if *value < 1_000 => format!("{value} us"),
        LadderOperand::Const { value, .. } if *value < 1_000_000 => format!("{} ms", fixed_point(*value, 3, 1)),
        LadderOperand::Const { value, .. } => format!("{} s", fixed_point(*value, 6, 3)),
    }
}

fn frequency(hertz: &LadderOperand) -> String {
    match hertz {
        LadderOperand::Var(name) => name.clone(),
        LadderOperand::Const { value, .. } if *value < 1_000 => format!("{value} Hz"),
        LadderOperand::Const { value, .. } => format!("{} kHz", fixed_point(*value, 3, 1)),
    }
}

/// Formats `value / 10^digits` exactly, with at least `least` digits after the decimal point.
fn fixed_point(value: i64, digits: u32, least: usize) -> String {
    let unit = 10_i64.pow(digits);
    let mut fraction = format!("{:0width$}", value % unit, width = digits as usize);
    while fraction.len() > least && fraction.ends_with('0') {
        fraction.pop();
    }
    format!("{}.{fraction}", value / unit)
}
