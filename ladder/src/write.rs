//! Writes a program as `.ld` text.

use std::fmt::Write;

use diag::text::{TextEncoding, to_code_page};

use crate::bus_elements;
use crate::comment_text;
use crate::model::{
    CompareOp, CounterKind, Element, FlowOp, LadderDialect, LadderOperand, LadderProgram, LdFormat, MathOp,
    ProgramSettings, PwmChoice, RungNode, SegmentDisplay, SerialTransfer, ShiftOp, TimerKind, UnaryOp,
};
use crate::pulse_elements;

/// Writes a program as `.ld` text in LDmicro's layout, and a program of dialect IEC as Instruction List.
///
/// Reading the text gives an equal program, except for the positions. The text equals the original up to
/// white space, blank lines and lines that begin with `;`, except where the reader reported LD018.
#[must_use]
pub fn write(program: &LadderProgram) -> String {
    if program.dialect == LadderDialect::Iec {
        return crate::il::program_text(program);
    }
    let mut out = String::new();
    let version = match (&program.style.header, program.format) {
        (Some(text), _) => text,
        (None, LdFormat::V01) => "0.1",
        (None, LdFormat::V02) => "0.2",
    };
    let _ = writeln!(out, "LDmicro{version}");
    write_settings(&mut out, &program.settings);
    if let Some(lines) = &program.pull_ups {
        write_list(&mut out, "PULL-UP LIST", lines.iter().map(String::as_str));
    }
    if let Some(vars) = &program.vars {
        write_list(&mut out, "VAR LIST", vars.iter().map(|v| v.text.as_str()));
    }
    let io: Vec<String> = program
        .io
        .iter()
        .map(|e| match e.modbus {
            None => format!("{} at {}", e.name, e.pin),
            Some((slave, address)) => format!("{} at {} {slave} {address}", e.name, e.pin),
        })
        .collect();
    write_list(&mut out, "IO LIST", io.iter().map(String::as_str));
    out.push_str("\nPROGRAM\n");
    for (number, rung) in (1..).zip(&program.rungs) {
        match program.style.rung_numbers {
            true => _ = writeln!(out, "RUNG {number}"),
            false => out.push_str("RUNG\n"),
        }
        write_series(&mut out, program, &rung.series, 1);
        out.push_str("END\n");
    }
    out
}

/// Writes a program as [`write()`] does, in the encoding and with the line ends with which it was read.
///
/// The result is UTF-8 if the program now contains characters that the code page lacks.
#[must_use]
pub fn write_bytes(program: &LadderProgram, encoding: TextEncoding) -> Vec<u8> {
    let text = match program.style.crlf {
        true => write(program).replace('\n', "\r\n"),
        false => write(program),
    };
    match encoding {
        TextEncoding::Bytes => to_code_page(&text).unwrap_or_else(|| text.into_bytes()),
        TextEncoding::Utf8 => text.into_bytes(),
    }
}

/// Formats an element as a line of `.ld` text, such as `CTU Ccnt 20`; reports and maps use it as the
/// element's title.
#[must_use]
pub fn element_text(element: &Element) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write_element(&mut out, element);
    out
}

fn write_settings(out: &mut String, settings: &ProgramSettings) {
    let mut setting = |name: &str, value: String, rest: &str| {
        let gap = if rest.is_empty() { "" } else { " " };
        let _ = writeln!(out, "{name}={value}{gap}{rest}");
    };
    if let Some(micro) = &settings.micro {
        setting("MICRO", micro.clone(), "");
    }
    setting("CYCLE", settings.cycle_us.to_string(), &settings.cycle_rest);
    setting("CRYSTAL", settings.crystal_hz.to_string(), &settings.crystal_rest);
    if let Some(baud) = settings.baud {
        setting("BAUD", baud.to_string(), &settings.baud_rest);
    }
    if let Some(compiled) = &settings.compiled {
        setting("COMPILED", compiled.clone(), "");
    }
    if let Some(compiler) = &settings.compiler {
        setting("COMPILER", compiler.clone(), "");
    }
}

fn write_list<'a>(out: &mut String, name: &str, lines: impl Iterator<Item = &'a str>) {
    let _ = writeln!(out, "\n{name}");
    for line in lines {
        let _ = writeln!(out, "    {line}");
    }
    out.push_str("END\n");
}

fn write_series(out: &mut String, program: &LadderProgram, nodes: &[RungNode], depth: usize) {
    let indent = "    ".repeat(depth);
    for node in nodes {
        match node {
            RungNode::Leaf(Element::Comment(text), _) => {
                let line = format!("{indent}COMMENT {}", comment_text::escape(text, program));
                let _ = writeln!(out, "{}", line.trim_end());
            }
            RungNode::Leaf(element, _) => {
                let _ = writeln!(out, "{indent}{}", element_text(element));
            }
            RungNode::Parallel(branches, _) => {
                let _ = writeln!(out, "{indent}PARALLEL");
                for branch in branches {
                    if let [RungNode::Leaf(..)] = branch.as_slice() {
                        write_series(out, program, branch, depth + 1);
                    } else {
                        let _ = writeln!(out, "{indent}    SERIES");
                        write_series(out, program, branch, depth + 2);
                        let _ = writeln!(out, "{indent}    END");
                    }
                }
                let _ = writeln!(out, "{indent}END");
            }
        }
    }
}

fn write_element(out: &mut String, element: &Element) -> std::fmt::Result {
    match element {
        Element::Comment(text) if text.is_empty() => write!(out, "COMMENT"),
        Element::Comment(text) => {
            write!(out, "COMMENT {}", comment_text::escape_in_dialect(text, LadderDialect::Ldmicro5))
        }
        Element::Contacts { name, negated, set1 } => {
            write!(out, "CONTACTS {name} {}", u8::from(*negated))?;
            set1.iter().try_for_each(|f| write!(out, " {f}"))
        }
        Element::Coil { name, negated, set, reset, ttrigger } => {
            write!(out, "COIL {name} {} {} {}", u8::from(*negated), u8::from(*set), u8::from(*reset))?;
            ttrigger.iter().try_for_each(|f| write!(out, " {f}"))
        }
        Element::Short => write!(out, "SHORT"),
        Element::Open => write!(out, "OPEN"),
        Element::Placeholder => write!(out, "PLACEHOLDER"),
        Element::MasterRelay => write!(out, "MASTER_RELAY"),
        Element::Osr => write!(out, "OSR"),
        Element::Osf => write!(out, "OSF"),
        Element::Odr => write!(out, "ODR"),
        Element::Odf => write!(out, "ODF"),
        Element::Osl => write!(out, "OSL"),
        Element::Osc => write!(out, "OSC"),
        Element::Timer { kind, name, delay, adjust } => {
            write!(out, "{} {name} {}", timer_keyword(*kind), operand_text(delay))?;
            adjust.iter().try_for_each(|a| write!(out, " {}", operand_text(a)))
        }
        Element::Counter { kind, name, max, init, input } => {
            write!(out, "{} {name} {}", counter_keyword(*kind), operand_text(max))?;
            init.iter().try_for_each(|i| write!(out, " {}", operand_text(i)))?;
            input.iter().try_for_each(|k| write!(out, " {k}"))
        }
        Element::Res { name } => write!(out, "RES {name}"),
        Element::Move { dest, src } => write!(out, "MOVE {dest} {}", operand_text(src)),
        Element::Math { op, dest, op1, op2 } => {
            write!(out, "{} {dest} {} {}", math_keyword(*op), operand_text(op1), operand_text(op2))
        }
        Element::Unary { op, dest, src } => write!(out, "{} {dest} {}", unary_keyword(*op), operand_text(src)),
        Element::Shift { op, dest, src, count } => {
            write!(out, "{} {dest} {} {}", shift_keyword(*op), operand_text(src), operand_text(count))
        }
        Element::BitWrite { name, bit, value } => {
            write!(out, "{} {name} {}", bit_write_keyword(*value), operand_text(bit))
        }
        Element::BitTest { name, bit, value } => {
            write!(out, "{} {name} {}", bit_test_keyword(*value), operand_text(bit))
        }
        Element::Bus { dest, src, targets } => {
            write!(out, "BUS {dest} {}", operand_text(src))?;
            targets.iter().rev().try_for_each(|bit| write!(out, " {bit}"))
        }
        Element::Flow { op, label } => write!(out, "{} {label}", flow_keyword(*op)),
        Element::Return => write!(out, "RETURN"),
        Element::Segments { display, dest, src, common } => {
            write!(out, "{} {dest} {} {common}", segments_keyword(*display), operand_text(src))
        }
        Element::TimeValue { is_scans, dest, time } => {
            write!(out, "{} {dest} {}", time_value_keyword(*is_scans), operand_text(time))
        }
        Element::Random { dest } => write!(out, "RANDOM {dest}"),
        Element::SeedRandom { dest, src } => write!(out, "SEED_RANDOM {dest} {}", operand_text(src)),
        Element::Delay { time } => write!(out, "DELAY {}", operand_text(time)),
        Element::Sleep => write!(out, "SLEEP"),
        Element::ClearWatchdog => write!(out, "CLRWDT"),
        Element::Lock => write!(out, "LOCK"),
        Element::Compare { op, op1, op2 } => {
            write!(out, "{} {} {}", compare_keyword(*op), operand_text(op1), operand_text(op2))
        }
        Element::ShiftRegister { name, stages } => write!(out, "SHIFT_REGISTER {name} {stages}"),
        Element::LookUpTable { dest, index, as_string, values, name } => {
            let flag = u8::from(*as_string);
            write!(out, "LOOK_UP_TABLE {dest} {} {} {flag}", operand_text(index), values.len())?;
            values.iter().try_for_each(|v| write!(out, " {v}"))?;
            name.iter().try_for_each(|name| write!(out, " {name}"))
        }
        Element::PiecewiseLinear { dest, index, points, name } => {
            write!(out, "PIECEWISE_LINEAR {dest} {} {}", operand_text(index), points.len())?;
            points.iter().try_for_each(|point| write!(out, " {} {}", point.x, point.y))?;
            name.iter().try_for_each(|name| write!(out, " {name}"))
        }
        Element::ReadAdc { name, refs } => {
            write!(out, "READ_ADC {name}")?;
            refs.iter().try_for_each(|r| write!(out, " {r}"))
        }
        Element::SetPwm { duty, hertz, output } => {
            write!(out, "SET_PWM {} {}", operand_text(duty), operand_text(hertz))?;
            output
                .iter()
                .flat_map(|PwmChoice { name, resolution }| [name, resolution])
                .filter(|word| !word.is_empty())
                .try_for_each(|word| write!(out, " {word}"))
        }
        Element::UartRecv { name, rest } => write_uart(out, "UART_RECV", name, rest.as_ref()),
        Element::UartSend { name, rest } => write_uart(out, "UART_SEND", name, rest.as_ref()),
        Element::UartRecvAvail => write!(out, "UART_RECV_AVAIL"),
        Element::UartSendReady => write!(out, "UART_SEND_READY"),
        Element::NpulseOff => write!(out, "NPULSE_OFF"),
        Element::Pulser { .. } | Element::Npulse { .. } | Element::Stepper { .. } | Element::QuadEncod { .. } => {
            write!(out, "{}", pulse_elements::pulse_element_text(element))
        }
        Element::BusTransfer(transfer) => write!(out, "{}", bus_elements::bus_element_text(transfer)),
        Element::Persist { name } => write!(out, "PERSIST {name}"),
        Element::FormattedString { var, text, quoted } => {
            write!(out, "FORMATTED_STRING {}", var.as_deref().unwrap_or("(none)"))?;
            write_text(out, text, *quoted)
        }
        Element::Text { dest, var, text, quoted } => {
            let [dest, var] = [dest, var].map(|name| name.as_deref().unwrap_or("(none)"));
            write!(out, "STRING {dest} {var}")?;
            write_text(out, text, *quoted)
        }
        Element::Instruction(step) => write!(out, "{step}"),
    }
}

/// Writes a text in quotes, or as the number of its characters and their codes.
fn write_text(out: &mut String, text: &str, quoted: bool) -> std::fmt::Result {
    if quoted {
        return write!(out, " \"{text}\"");
    }
    write!(out, " {}", text.chars().count())?;
    text.chars().try_for_each(|c| write!(out, " {}", c as u32))
}

fn write_uart(out: &mut String, keyword: &str, name: &str, rest: Option<&SerialTransfer>) -> std::fmt::Result {
    write!(out, "{keyword} {name}")?;
    rest.iter().try_for_each(|SerialTransfer { bytes, wait }| write!(out, " {bytes} {wait}"))
}

/// The operand as spelled in the file.
pub(crate) fn operand_text(operand: &LadderOperand) -> &str {
    match operand {
        LadderOperand::Var(name) => name,
        LadderOperand::Const { text, .. } => text,
    }
}

/// Keyword of a timer in `.ld` text.
pub(crate) const fn timer_keyword(kind: TimerKind) -> &'static str {
    match kind {
        TimerKind::Ton => "TON",
        TimerKind::Tof => "TOF",
        TimerKind::Rto => "RTO",
        TimerKind::Rtl => "RTL",
        TimerKind::Tcy => "TCY",
        TimerKind::Thi => "THI",
        TimerKind::Tlo => "TLO",
    }
}

/// Keyword of a counter in `.ld` text.
pub(crate) const fn counter_keyword(kind: CounterKind) -> &'static str {
    match kind {
        CounterKind::Ctu => "CTU",
        CounterKind::Ctd => "CTD",
        CounterKind::Ctc => "CTC",
        CounterKind::Ctr => "CTR",
    }
}

/// Keyword of an arithmetic operation in `.ld` text.
pub(crate) const fn math_keyword(op: MathOp) -> &'static str {
    match op {
        MathOp::Add => "ADD",
        MathOp::Sub => "SUB",
        MathOp::Mul => "MUL",
        MathOp::Div => "DIV",
        MathOp::Mod => "MOD",
        MathOp::And => "AND",
        MathOp::Or => "OR",
        MathOp::Xor => "XOR",
    }
}

/// Returns the keyword of an operation with one operand.
pub(crate) const fn unary_keyword(op: UnaryOp) -> &'static str {
    match op {
        UnaryOp::Not => "NOT",
        UnaryOp::Neg => "NEG",
        UnaryOp::Swap => "SWAP",
        UnaryOp::Opposite => "OPPOSITE",
        UnaryOp::BinToBcd => "BIN2BCD",
        UnaryOp::BcdToBin => "BCD2BIN",
    }
}

/// Returns the keyword of a shift or rotation.
pub(crate) const fn shift_keyword(op: ShiftOp) -> &'static str {
    match op {
        ShiftOp::Shl => "SHL",
        ShiftOp::Shr => "SHR",
        ShiftOp::Sr0 => "SR0",
        ShiftOp::Rol => "ROL",
        ShiftOp::Ror => "ROR",
    }
}

/// Returns the keyword of an element that writes a bit of an integer.
pub(crate) const fn bit_write_keyword(value: bool) -> &'static str {
    if value { "SET_BIT" } else { "CLEAR_BIT" }
}

/// Returns the keyword of an element that tests a bit of an integer.
pub(crate) const fn bit_test_keyword(value: bool) -> &'static str {
    if value { "IF_BIT_SET" } else { "IF_BIT_CLEAR" }
}

/// Keyword of an element that writes a character as segments.
pub(crate) const fn segments_keyword(display: SegmentDisplay) -> &'static str {
    match display {
        SegmentDisplay::Seven => "7SEGMENTS",
        SegmentDisplay::Nine => "9SEGMENTS",
        SegmentDisplay::Fourteen => "14SEGMENTS",
        SegmentDisplay::Sixteen => "16SEGMENTS",
    }
}

/// Returns the keyword of an element that converts a time.
pub(crate) const fn time_value_keyword(is_scans: bool) -> &'static str {
    if is_scans { "TIME2COUNT" } else { "TIME2DELAY" }
}

/// Keyword of an element that names a place of the program.
pub(crate) const fn flow_keyword(op: FlowOp) -> &'static str {
    match op {
        FlowOp::Label => "LABEL",
        FlowOp::Goto => "GOTO",
        FlowOp::Gosub => "GOSUB",
        FlowOp::Subprogram => "SUBPROG",
        FlowOp::EndSubprogram => "ENDSUB",
    }
}

/// Keyword of a comparison in `.ld` text.
pub(crate) const fn compare_keyword(op: CompareOp) -> &'static str {
    match op {
        CompareOp::Equ => "EQU",
        CompareOp::Neq => "NEQ",
        CompareOp::Grt => "GRT",
        CompareOp::Geq => "GEQ",
        CompareOp::Les => "LES",
        CompareOp::Leq => "LEQ",
    }
}
