//! Reads the line of one element into the model.

use diag::{Pos, Severity, nearest};

use crate::argument_count::check_argument_count;
use crate::bus_elements;
use crate::codes;
use crate::comment_text;
use crate::counted_elements;
use crate::element_keywords::{ELEMENT_KEYWORDS, ElementKeyword, OLD_KEYWORDS, UNSUPPORTED_KEYWORDS};
use crate::lexer::{self, LdLine, LdToken};
use crate::model::{
    CompareOp, CounterKind, Element, FlowOp, LadderDialect, LadderOperand, MathOp, PwmChoice, SegmentDisplay,
    SerialTransfer, ShiftOp, TimerKind, UnaryOp,
};
use crate::pulse_elements;
use crate::reader::{LdReader, message_text};

/// Reads one element; returns `None` after it has reported at least one error.
pub(crate) fn read_element(reader: &mut LdReader<'_>, line: &LdLine<'_>) -> Option<Element> {
    let (keyword, args) = line.tokens.split_first()?;
    let name = known_spelling(reader, *keyword);
    let Some(row) = ELEMENT_KEYWORDS.iter().find(|(k, ..)| *k == name) else {
        report_unknown_keyword(reader, *keyword);
        return None;
    };
    if row.0 == "COMMENT" {
        return Some(Element::Comment(comment_text::unescape(line.rest(), reader.dialect)));
    }
    let args = check_argument_count(reader, row, *keyword, args)?;
    build_element(reader, line, row, args)
}

/// The keyword of an element that LDmicro 5 also reads under an older name.
fn known_spelling<'a>(reader: &mut LdReader<'_>, keyword: LdToken<'a>) -> &'a str {
    let known = OLD_KEYWORDS.iter().find(|(old, _)| *old == keyword.text);
    let Some((_, now)) = known.filter(|_| reader.dialect == LadderDialect::Ldmicro5) else { return keyword.text };
    let cause = format!("{} is an older name of {now}", keyword.text);
    reader.report(Severity::Note, codes::OLD_KEYWORD, keyword.pos, cause, format!("write {now}"));
    now
}

fn report_unknown_keyword(reader: &mut LdReader<'_>, keyword: LdToken<'_>) {
    let word = message_text(keyword.text);
    if let Some((_, reason, instead)) = UNSUPPORTED_KEYWORDS.iter().find(|(name, ..)| *name == keyword.text) {
        let cause = format!("{word} is known in LDmicro 5, not supported here: {reason}");
        return reader.error(codes::LDMICRO5_ONLY, keyword.pos, cause, *instead);
    }
    let known = ELEMENT_KEYWORDS.iter().map(|r| r.0).chain(["RUNG", "PARALLEL", "SERIES", "END"]);
    let hint = match nearest(keyword.text, known) {
        Some(near) => format!("did you mean {near}?"),
        None => "the first word of a line names the element, such as CONTACTS or COIL".to_owned(),
    };
    reader.error(codes::UNKNOWN_KEYWORD, keyword.pos, format!("unknown keyword `{word}`"), hint);
}

#[rustfmt::skip]
fn build_element(r: &mut LdReader<'_>, line: &LdLine<'_>, row: &ElementKeyword, args: &[LdToken<'_>]) -> Option<Element> {
    let keyword = row.0;
    Some(match (keyword, args) {
        ("CONTACTS", [name, flags @ ..]) => read_contacts(r, *name, flags)?,
        ("COIL", [name, flags @ ..]) => read_coil(r, *name, flags)?,
        ("SHORT", _) => Element::Short,
        ("OPEN", _) => Element::Open,
        ("PLACEHOLDER", _) => Element::Placeholder,
        ("MASTER_RELAY", _) => Element::MasterRelay,
        ("OSR", _) => Element::Osr,
        ("OSF", _) => Element::Osf,
        ("ODR", _) => Element::Odr,
        ("ODF", _) => Element::Odf,
        ("OSL", _) => Element::Osl,
        ("OSC", _) => Element::Osc,
        ("TON", [name, rest @ ..]) => read_timer(r, TimerKind::Ton, keyword, *name, rest)?,
        ("TOF", [name, rest @ ..]) => read_timer(r, TimerKind::Tof, keyword, *name, rest)?,
        ("RTO", [name, rest @ ..]) => read_timer(r, TimerKind::Rto, keyword, *name, rest)?,
        ("RTL", [name, rest @ ..]) => read_timer(r, TimerKind::Rtl, keyword, *name, rest)?,
        ("TCY", [name, rest @ ..]) => read_timer(r, TimerKind::Tcy, keyword, *name, rest)?,
        ("THI", [name, rest @ ..]) => read_timer(r, TimerKind::Thi, keyword, *name, rest)?,
        ("TLO", [name, rest @ ..]) => read_timer(r, TimerKind::Tlo, keyword, *name, rest)?,
        ("CTU", [name, rest @ ..]) => read_counter(r, CounterKind::Ctu, keyword, *name, rest)?,
        ("CTD", [name, rest @ ..]) => read_counter(r, CounterKind::Ctd, keyword, *name, rest)?,
        ("CTC", [name, rest @ ..]) => read_counter(r, CounterKind::Ctc, keyword, *name, rest)?,
        ("CTR", [name, rest @ ..]) => read_counter(r, CounterKind::Ctr, keyword, *name, rest)?,
        ("RES", [name]) => Element::Res { name: r.read_integer_name(keyword, *name)? },
        ("MOVE", [dest, src]) => {
            let (dest, src) = (read_destination(r, keyword, *dest), read_operand(r, keyword, *src));
            Element::Move { dest: dest?, src: src? }
        }
        ("ADD", [d, a, b]) => read_math(r, MathOp::Add, keyword, [*d, *a, *b])?,
        ("SUB", [d, a, b]) => read_math(r, MathOp::Sub, keyword, [*d, *a, *b])?,
        ("MUL", [d, a, b]) => read_math(r, MathOp::Mul, keyword, [*d, *a, *b])?,
        ("DIV", [d, a, b]) => read_math(r, MathOp::Div, keyword, [*d, *a, *b])?,
        ("MOD", [d, a, b]) => read_math(r, MathOp::Mod, keyword, [*d, *a, *b])?,
        ("AND", [d, a, b]) => read_math(r, MathOp::And, keyword, [*d, *a, *b])?,
        ("OR", [d, a, b]) => read_math(r, MathOp::Or, keyword, [*d, *a, *b])?,
        ("XOR", [d, a, b]) => read_math(r, MathOp::Xor, keyword, [*d, *a, *b])?,
        ("NOT", [dest, src]) => read_unary(r, UnaryOp::Not, keyword, *dest, *src)?,
        ("NEG", [dest, src]) => read_unary(r, UnaryOp::Neg, keyword, *dest, *src)?,
        ("SWAP", [dest, src]) => read_unary(r, UnaryOp::Swap, keyword, *dest, *src)?,
        ("OPPOSITE", [dest, src]) => read_unary(r, UnaryOp::Opposite, keyword, *dest, *src)?,
        ("BIN2BCD", [dest, src]) => read_unary(r, UnaryOp::BinToBcd, keyword, *dest, *src)?,
        ("BCD2BIN", [dest, src]) => read_unary(r, UnaryOp::BcdToBin, keyword, *dest, *src)?,
        ("SHL", [d, a, n]) => read_shift(r, ShiftOp::Shl, keyword, [*d, *a, *n])?,
        ("SHR", [d, a, n]) => read_shift(r, ShiftOp::Shr, keyword, [*d, *a, *n])?,
        ("SR0", [d, a, n]) => read_shift(r, ShiftOp::Sr0, keyword, [*d, *a, *n])?,
        ("ROL", [d, a, n]) => read_shift(r, ShiftOp::Rol, keyword, [*d, *a, *n])?,
        ("ROR", [d, a, n]) => read_shift(r, ShiftOp::Ror, keyword, [*d, *a, *n])?,
        ("SET_BIT" | "CLEAR_BIT", [name, bit]) => {
            let (name, bit) = (read_destination(r, keyword, *name), read_operand(r, keyword, *bit));
            Element::BitWrite { name: name?, bit: bit?, value: keyword == "SET_BIT" }
        }
        ("IF_BIT_SET" | "IF_BIT_CLEAR", [name, bit]) => {
            let (name, bit) = (r.read_integer_name(keyword, *name), read_operand(r, keyword, *bit));
            Element::BitTest { name: name?, bit: bit?, value: keyword == "IF_BIT_SET" }
        }
        ("BUS", [dest, src, targets @ ..]) => read_bus(r, keyword, *dest, *src, targets)?,
        ("LABEL", [label]) => Element::Flow { op: FlowOp::Label, label: r.read_name(*label)? },
        ("GOTO", [label]) => Element::Flow { op: FlowOp::Goto, label: read_target(r, *label)? },
        ("GOSUB", [label]) => Element::Flow { op: FlowOp::Gosub, label: r.read_name(*label)? },
        ("SUBPROG", [label]) => Element::Flow { op: FlowOp::Subprogram, label: r.read_name(*label)? },
        ("ENDSUB", [label]) => Element::Flow { op: FlowOp::EndSubprogram, label: r.read_name(*label)? },
        ("RETURN", _) => Element::Return,
        ("7SEGMENTS", [d, s, c]) => read_segments(r, SegmentDisplay::Seven, keyword, [*d, *s, *c])?,
        ("9SEGMENTS", [d, s, c]) => read_segments(r, SegmentDisplay::Nine, keyword, [*d, *s, *c])?,
        ("14SEGMENTS", [d, s, c]) => read_segments(r, SegmentDisplay::Fourteen, keyword, [*d, *s, *c])?,
        ("16SEGMENTS", [d, s, c]) => read_segments(r, SegmentDisplay::Sixteen, keyword, [*d, *s, *c])?,
        ("TIME2COUNT" | "TIME2DELAY", [dest, time]) => {
            let (dest, time) = (read_destination(r, keyword, *dest), read_operand_in_range(r, keyword, *time, "the time in microseconds", 0, 1_000_000_000_000));
            Element::TimeValue { is_scans: keyword == "TIME2COUNT", dest: dest?, time: time? }
        }
        ("RANDOM", [dest]) => Element::Random { dest: read_destination(r, keyword, *dest)? },
        ("SEED_RANDOM", [dest, src]) => {
            let (dest, src) = (read_destination(r, keyword, *dest), read_operand(r, keyword, *src));
            Element::SeedRandom { dest: dest?, src: src? }
        }
        ("DELAY", [time]) => Element::Delay { time: read_operand(r, keyword, *time)? },
        ("SLEEP", _) => Element::Sleep,
        ("CLRWDT", _) => Element::ClearWatchdog,
        ("LOCK", _) => Element::Lock,
        ("EQU", [a, b]) => read_compare(r, CompareOp::Equ, keyword, [*a, *b])?,
        ("NEQ", [a, b]) => read_compare(r, CompareOp::Neq, keyword, [*a, *b])?,
        ("GRT", [a, b]) => read_compare(r, CompareOp::Grt, keyword, [*a, *b])?,
        ("GEQ", [a, b]) => read_compare(r, CompareOp::Geq, keyword, [*a, *b])?,
        ("LES", [a, b]) => read_compare(r, CompareOp::Les, keyword, [*a, *b])?,
        ("LEQ", [a, b]) => read_compare(r, CompareOp::Leq, keyword, [*a, *b])?,
        ("SHIFT_REGISTER", [name, stages]) => {
            let (name, stages) = (r.read_integer_name(keyword, *name), r.read_u32(*stages, "the number of stages", 1, 256));
            Element::ShiftRegister { name: name?, stages: stages? }
        }
        ("LOOK_UP_TABLE", [dest, index, count, flag, values @ ..]) => counted_elements::read_look_up_table(r, row, [*dest, *index, *count, *flag], values)?,
        ("PIECEWISE_LINEAR", [dest, index, count, values @ ..]) => counted_elements::read_piecewise_linear(r, row, [*dest, *index, *count], values)?,
        ("READ_ADC", [name, refs @ ..]) => read_adc(r, *name, refs)?,
        ("SET_PWM", [duty, hertz, output @ ..]) => set_pwm(r, *duty, *hertz, output)?,
        ("UART_RECV", [name, rest @ ..]) => {
            let (name, rest) = (r.read_integer_name(keyword, *name), read_uart_arguments(r, rest));
            Element::UartRecv { name: name?, rest: rest? }
        }
        ("UART_SEND", [name, rest @ ..]) => {
            let (name, rest) = (r.read_integer_name(keyword, *name), read_uart_arguments(r, rest));
            Element::UartSend { name: name?, rest: rest? }
        }
        ("UART_RECV_AVAIL", _) => Element::UartRecvAvail,
        ("UART_SEND_READY", _) => Element::UartSendReady,
        ("NPULSE_OFF", _) => Element::NpulseOff,
        ("PULSER" | "NPULSE" | "STEPPER" | "QUAD_ENCOD", args) => pulse_elements::read_pulse_element(r, keyword, args)?,
        ("SPI" | "SPI_WR" | "I2C_RD" | "I2C_WR", args) => bus_elements::read_bus_element(r, keyword, args)?,
        ("PERSIST", [name]) => Element::Persist { name: r.read_integer_name(keyword, *name)? },
        ("STRING", [dest, rest @ ..]) => counted_elements::read_text(r, line, row, *dest, rest)?,
        ("FORMATTED_STRING", [var, rest @ ..]) => counted_elements::read_formatted_string(r, line, row, *var, rest)?,
        // The argument count was checked against the row, so every valid line matches an arm above.
        _ => return None,
    })
}

/// A label, or the number of a rung.
fn read_target(r: &mut LdReader<'_>, token: LdToken<'_>) -> Option<String> {
    if !token.text.starts_with(|c: char| c.is_ascii_digit()) {
        return r.read_name(token);
    }
    if lexer::parse_number(token.text) == Some(0) {
        let cause = "GOTO 0 leads nowhere: LDmicro 5 counts rungs from 1";
        r.error(codes::OUT_OF_RANGE, token.pos, cause, "write GOTO 1 for the first rung, or the name of a LABEL");
        return None;
    }
    r.read_u32(token, "the number of a rung", 1, u32::MAX).map(|_| token.text.to_owned())
}

fn read_contacts(r: &mut LdReader<'_>, name: LdToken<'_>, flags: &[LdToken<'_>]) -> Option<Element> {
    let name = read_bit_name(
        r,
        name,
        &['X', 'Y', 'R'],
        codes::CONTACT_KIND,
        "CONTACTS",
        "test an integer with EQU, GEQ or the like",
    );
    let flags = read_flags(r, flags, &["negated", "set1"]);
    let (name, flags) = (name?, flags?);
    Some(Element::Contacts { name, negated: flags.first() == Some(&1), set1: flags.get(1).copied() })
}

fn read_coil(r: &mut LdReader<'_>, name: LdToken<'_>, flags: &[LdToken<'_>]) -> Option<Element> {
    let name = read_bit_name(
        r,
        name,
        &['Y', 'R'],
        codes::COIL_KIND,
        "COIL",
        "write an integer with MOVE; inputs cannot be written",
    );
    let flags = read_flags(r, flags, &["negated", "set", "reset", "ttrigger"]);
    let (name, flags) = (name?, flags?);
    let is = |i: usize| flags.get(i) == Some(&1);
    Some(Element::Coil { name, negated: is(0), set: is(1), reset: is(2), ttrigger: flags.get(3).copied() })
}

/// Reads the name of a bit that begins with one of these letters.
pub(crate) fn read_bit_name(
    r: &mut LdReader<'_>,
    token: LdToken<'_>,
    letters: &[char],
    code: &'static str,
    who: &str,
    hint: &str,
) -> Option<String> {
    let name = r.read_name(token)?;
    if name.starts_with(['X', 'Y', 'R']) {
        r.use_as_bit(&name);
    }
    if !name.starts_with(letters) {
        let is_modbus = r.dialect == LadderDialect::Ldmicro5 && name.starts_with(['I', 'M']);
        let wanted: Vec<String> = letters.iter().map(|l| format!("{l}..")).collect();
        r.error(
            code,
            token.pos,
            format!("{who} needs a name {}, found {}", wanted.join(" or "), message_text(&name)),
            if is_modbus { "I.. and M.. belong to Modbus, which is not supported here: take an R.." } else { hint },
        );
        return None;
    }
    Some(name)
}

/// Reads all flags before it fails, so that every invalid flag is reported.
fn read_flags(r: &mut LdReader<'_>, tokens: &[LdToken<'_>], names: &[&str]) -> Option<Vec<u32>> {
    let read: Vec<Option<u32>> =
        tokens.iter().zip(names).map(|(t, n)| r.read_flag(*t, &format!("the flag `{n}`"))).collect();
    read.into_iter().collect()
}

fn read_timer(
    r: &mut LdReader<'_>,
    kind: TimerKind,
    keyword: &'static str,
    name: LdToken<'_>,
    rest: &[LdToken<'_>],
) -> Option<Element> {
    let name = r.read_integer_name(keyword, name);
    let delay = rest
        .first()
        .and_then(|t| read_operand_in_range(r, keyword, *t, "the delay in microseconds", 0, 1_000_000_000_000));
    let adjust = rest.get(1).map(|t| read_operand(r, keyword, *t));
    Some(Element::Timer { kind, name: name?, delay: delay?, adjust: transpose_optional(adjust)? })
}

fn read_counter(
    r: &mut LdReader<'_>,
    kind: CounterKind,
    keyword: &'static str,
    name: LdToken<'_>,
    rest: &[LdToken<'_>],
) -> Option<Element> {
    let name = r.read_integer_name(keyword, name);
    let max = rest.first().and_then(|t| read_constant(r, keyword, *t, "the counter's limit"));
    let init = rest.get(1).map(|t| read_operand(r, keyword, *t));
    let input = rest.get(2).map(|t| read_input_kind(r, *t));
    Some(Element::Counter {
        kind,
        name: name?,
        max: max?,
        init: transpose_optional(init)?,
        input: transpose_optional(input)?,
    })
}

/// Reads when an input counts.
pub(crate) fn read_input_kind(r: &mut LdReader<'_>, token: LdToken<'_>) -> Option<char> {
    match token.text {
        "/" => Some('/'),
        "\\" => Some('\\'),
        "-" => Some('-'),
        "o" => Some('o'),
        other => {
            let cause = format!("the counter's input kind is `{}`, allowed are / \\ - o", message_text(other));
            r.error(codes::OUT_OF_RANGE, token.pos, cause, "write / for rising edges");
            None
        }
    }
}

fn read_math(r: &mut LdReader<'_>, op: MathOp, keyword: &'static str, args: [LdToken<'_>; 3]) -> Option<Element> {
    let [dest, op1, op2] = args;
    let (dest, op1, op2) =
        (read_destination(r, keyword, dest), read_operand(r, keyword, op1), read_operand(r, keyword, op2));
    Some(Element::Math { op, dest: dest?, op1: op1?, op2: op2? })
}

fn read_unary(
    r: &mut LdReader<'_>,
    op: UnaryOp,
    keyword: &'static str,
    dest: LdToken<'_>,
    src: LdToken<'_>,
) -> Option<Element> {
    let (dest, src) = (read_destination(r, keyword, dest), read_operand(r, keyword, src));
    Some(Element::Unary { op, dest: dest?, src: src? })
}

fn read_shift(r: &mut LdReader<'_>, op: ShiftOp, keyword: &'static str, args: [LdToken<'_>; 3]) -> Option<Element> {
    let [dest, src, count] = args;
    let (dest, src, count) =
        (read_destination(r, keyword, dest), read_operand(r, keyword, src), read_operand(r, keyword, count));
    Some(Element::Shift { op, dest: dest?, src: src?, count: count? })
}

fn read_segments(
    r: &mut LdReader<'_>,
    display: SegmentDisplay,
    keyword: &'static str,
    [dest, src, common]: [LdToken<'_>; 3],
) -> Option<Element> {
    let (dest, src) = (read_destination(r, keyword, dest), read_operand(r, keyword, src));
    let mut letters = common.text.chars();
    let (Some(letter), None) = (letters.next().filter(char::is_ascii_alphabetic), letters.next()) else {
        let cause = format!("the kind of display is `{}`, a letter is needed", message_text(common.text));
        r.error(codes::OUT_OF_RANGE, common.pos, cause, "write C for a common cathode, or A for a common anode");
        return None;
    };
    Some(Element::Segments { display, dest: dest?, src: src?, common: letter })
}

/// The text begins with where bit 7 goes.
fn read_bus(
    r: &mut LdReader<'_>,
    keyword: &'static str,
    dest: LdToken<'_>,
    src: LdToken<'_>,
    targets: &[LdToken<'_>],
) -> Option<Element> {
    let (dest, src) = (read_destination(r, keyword, dest), read_operand(r, keyword, src));
    let read: Vec<Option<u32>> = targets.iter().map(|t| r.read_u32(*t, "a bit of BUS", 0, 7)).collect();
    let read: Vec<u8> =
        read.into_iter().rev().map(|bit| bit.and_then(|bit| u8::try_from(bit).ok())).collect::<Option<_>>()?;
    Some(Element::Bus { dest: dest?, src: src?, targets: read.try_into().ok()? })
}

fn read_compare(r: &mut LdReader<'_>, op: CompareOp, keyword: &'static str, args: [LdToken<'_>; 2]) -> Option<Element> {
    let [op1, op2] = args;
    let (op1, op2) = (read_operand(r, keyword, op1), read_operand(r, keyword, op2));
    Some(Element::Compare { op, op1: op1?, op2: op2? })
}

fn read_adc(r: &mut LdReader<'_>, token: LdToken<'_>, refs: &[LdToken<'_>]) -> Option<Element> {
    let name = r.read_integer_name("READ_ADC", token);
    let refs = refs.first().map(|t| r.read_u32(*t, "the reference selection", 0, 255));
    let name = name?;
    if !name.starts_with('A') {
        let cause = format!("READ_ADC needs a name A.., found {}", message_text(&name));
        r.error(codes::BAD_NAME, token.pos, cause, "let the name of the analog input begin with A");
        return None;
    }
    Some(Element::ReadAdc { name, refs: transpose_optional(refs)? })
}

fn set_pwm(r: &mut LdReader<'_>, duty: LdToken<'_>, hertz: LdToken<'_>, output: &[LdToken<'_>]) -> Option<Element> {
    let duty = read_operand(r, "SET_PWM", duty);
    let hertz = read_operand_in_range(r, "SET_PWM", hertz, "the frequency in Hz", 1, 100_000_000);
    let output = match output {
        [name, resolution @ ..] => {
            let resolution = resolution.first().map_or("", |token| token.text);
            read_pwm_name(r, *name).map(|name| Some(PwmChoice { name, resolution: resolution.to_owned() }))
        }
        _ => Some(None),
    };
    Some(Element::SetPwm { duty: duty?, hertz: hertz?, output: output? })
}

/// The name of an output of SET_PWM, which begins with P: LDmicro 5 puts it before any other name.
fn read_pwm_name(r: &mut LdReader<'_>, token: LdToken<'_>) -> Option<String> {
    let name = r.read_name(token)?;
    if r.dialect != LadderDialect::Ldmicro5 || name.starts_with('P') {
        return Some(name);
    }
    let cause = format!("the output {} of SET_PWM is P{name} in LDmicro 5", message_text(&name));
    r.report(Severity::Note, codes::BAD_NAME, token.pos, cause, format!("write P{}", message_text(&name)));
    Some(format!("P{name}"))
}

fn read_uart_arguments(r: &mut LdReader<'_>, rest: &[LdToken<'_>]) -> Option<Option<SerialTransfer>> {
    match rest {
        [bytes, wait] => {
            let (bytes, wait) =
                (r.read_u32(*bytes, "the number of bytes", 1, 255), r.read_flag(*wait, "the flag `wait`"));
            Some(Some(SerialTransfer { bytes: bytes?, wait: wait? }))
        }
        _ => Some(None),
    }
}

/// Turns an absent argument into `Some(None)` and an invalid one into `None`.
fn transpose_optional<T>(read: Option<Option<T>>) -> Option<Option<T>> {
    match read {
        None => Some(None),
        Some(value) => value.map(Some),
    }
}

/// Reads the name of the variable that an element writes.
pub(crate) fn read_destination(r: &mut LdReader<'_>, keyword: &'static str, token: LdToken<'_>) -> Option<String> {
    if lexer::looks_like_number(token.text) {
        let cause = format!("{keyword} cannot write to the constant {}", message_text(token.text));
        r.error(
            codes::CONSTANT_TARGET,
            token.pos,
            cause,
            "the first argument is the variable that receives the result",
        );
        return None;
    }
    r.read_integer_name(keyword, token)
}

/// Reads an operand: a variable or a constant.
pub(crate) fn read_operand(r: &mut LdReader<'_>, keyword: &'static str, token: LdToken<'_>) -> Option<LadderOperand> {
    read_constant(r, keyword, token, "a constant")
}

/// Reads a variable or a constant in the dialect's range; `what` names it in messages.
fn read_constant(r: &mut LdReader<'_>, keyword: &'static str, token: LdToken<'_>, what: &str) -> Option<LadderOperand> {
    let (low, high) = r.constant_range().into_inner();
    read_operand_in_range(r, keyword, token, what, low, high)
}

/// Reads a constant within a range, or the name of a symbol.
pub(crate) fn read_operand_in_range(
    r: &mut LdReader<'_>,
    keyword: &'static str,
    token: LdToken<'_>,
    what: &str,
    low: i64,
    high: i64,
) -> Option<LadderOperand> {
    if lexer::looks_like_number(token.text) {
        let value = r.read_constant(token, what, low, high)?;
        return Some(LadderOperand::Const { value, text: token.text.to_owned() });
    }
    r.read_integer_name(keyword, token).map(LadderOperand::Var)
}

/// Position that spans from the first to the last of several words of a line.
pub(crate) fn join_positions(first: Pos, last: Pos) -> Pos {
    Pos::new(first.line, first.column, (last.column + last.width).saturating_sub(first.column))
}
