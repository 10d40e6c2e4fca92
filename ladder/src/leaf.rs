//! The reader of each element: its line of text into the model.

use diag::{Pos, nearest};

use crate::codes;
use crate::lex::{self, Line, Token};
use crate::model::{CompareOp, CounterKind, Element, MathOp, Operand, TimerKind};
use crate::reader::{Reader, shown};
use crate::rows::{ANY, LDMICRO5, LEAVES, Row};
use crate::table;

/// Reads one element; complaints go to the reader, and `None` means that there was at least one.
pub(crate) fn leaf(reader: &mut Reader<'_>, line: &Line<'_>) -> Option<Element> {
    let (keyword, args) = line.tokens.split_first()?;
    let Some(row) = LEAVES.iter().find(|(k, ..)| *k == keyword.text) else {
        unknown(reader, *keyword);
        return None;
    };
    if row.0 == "COMMENT" {
        return Some(Element::Comment(unescape(line.rest())));
    }
    count(reader, row, *keyword, args)?;
    element(reader, line, row, args)
}

fn unknown(reader: &mut Reader<'_>, keyword: Token<'_>) {
    let word = shown(keyword.text);
    if LDMICRO5.contains(&keyword.text) {
        let cause = format!("{word} is known in LDmicro 5, not supported here");
        let hint = "express it by the elements of release 2.3";
        return reader.error(codes::LDMICRO5_ONLY, keyword.pos, cause, hint);
    }
    let known = LEAVES.iter().map(|r| r.0).chain(["RUNG", "PARALLEL", "SERIES", "END"]);
    let hint = match nearest(keyword.text, known) {
        Some(near) => format!("did you mean {near}?"),
        None => "the first word of a line names the element, such as CONTACTS or COIL".to_owned(),
    };
    reader.error(codes::UNKNOWN_KEYWORD, keyword.pos, format!("unknown keyword `{word}`"), hint);
}

/// Checks the number of arguments, and marks the first one too many or the keyword that has too few.
pub(crate) fn count(reader: &mut Reader<'_>, row: &Row, keyword: Token<'_>, args: &[Token<'_>]) -> Option<()> {
    let &(name, least, most, syntax) = row;
    let wanted = if least == most { format!("{least}") } else { format!("{least} to {most}") };
    let wanted = if most == ANY { format!("at least {least}") } else { wanted };
    let cause = format!("{name} takes {wanted} argument(s), found {}", args.len());
    if args.len() < least {
        reader.error(codes::TOO_FEW, keyword.pos, cause, format!("write {syntax}"));
        return None;
    }
    if let Some(extra) = args.get(most) {
        reader.error(codes::TOO_MANY, extra.pos, cause, format!("write {syntax}"));
        return None;
    }
    // These two optional arguments come only as a pair.
    if matches!(name, "SET_PWM" | "UART_RECV" | "UART_SEND") && args.len() + 1 == most {
        reader.error(codes::TOO_FEW, keyword.pos, cause, format!("write {syntax}, the last two both or neither"));
        return None;
    }
    Some(())
}

#[rustfmt::skip]
fn element(r: &mut Reader<'_>, line: &Line<'_>, row: &Row, args: &[Token<'_>]) -> Option<Element> {
    let keyword = row.0;
    Some(match (keyword, args) {
        ("CONTACTS", [name, flags @ ..]) => contacts(r, *name, flags)?,
        ("COIL", [name, flags @ ..]) => coil(r, *name, flags)?,
        ("SHORT", _) => Element::Short,
        ("OPEN", _) => Element::Open,
        ("PLACEHOLDER", _) => Element::Placeholder,
        ("MASTER_RELAY", _) => Element::MasterRelay,
        ("OSR", _) => Element::Osr,
        ("OSF", _) => Element::Osf,
        ("TON", [name, rest @ ..]) => timer(r, TimerKind::Ton, keyword, *name, rest)?,
        ("TOF", [name, rest @ ..]) => timer(r, TimerKind::Tof, keyword, *name, rest)?,
        ("RTO", [name, rest @ ..]) => timer(r, TimerKind::Rto, keyword, *name, rest)?,
        ("CTU", [name, rest @ ..]) => counter(r, CounterKind::Ctu, keyword, *name, rest)?,
        ("CTD", [name, rest @ ..]) => counter(r, CounterKind::Ctd, keyword, *name, rest)?,
        ("CTC", [name, rest @ ..]) => counter(r, CounterKind::Ctc, keyword, *name, rest)?,
        ("RES", [name]) => Element::Res { name: r.integer(keyword, *name)? },
        ("MOVE", [dest, src]) => {
            let (dest, src) = (target(r, keyword, *dest), operand(r, keyword, *src));
            Element::Move { dest: dest?, src: src? }
        }
        ("ADD", [d, a, b]) => math(r, MathOp::Add, keyword, [*d, *a, *b])?,
        ("SUB", [d, a, b]) => math(r, MathOp::Sub, keyword, [*d, *a, *b])?,
        ("MUL", [d, a, b]) => math(r, MathOp::Mul, keyword, [*d, *a, *b])?,
        ("DIV", [d, a, b]) => math(r, MathOp::Div, keyword, [*d, *a, *b])?,
        ("EQU", [a, b]) => compare(r, CompareOp::Equ, keyword, [*a, *b])?,
        ("NEQ", [a, b]) => compare(r, CompareOp::Neq, keyword, [*a, *b])?,
        ("GRT", [a, b]) => compare(r, CompareOp::Grt, keyword, [*a, *b])?,
        ("GEQ", [a, b]) => compare(r, CompareOp::Geq, keyword, [*a, *b])?,
        ("LES", [a, b]) => compare(r, CompareOp::Les, keyword, [*a, *b])?,
        ("LEQ", [a, b]) => compare(r, CompareOp::Leq, keyword, [*a, *b])?,
        ("SHIFT_REGISTER", [name, stages]) => {
            let (name, stages) = (r.integer(keyword, *name), r.small(*stages, "the number of stages", 1, 256));
            Element::ShiftRegister { name: name?, stages: stages? }
        }
        ("LOOK_UP_TABLE", [dest, index, count, flag, values @ ..]) => table::look_up(r, row, [*dest, *index, *count, *flag], values)?,
        ("PIECEWISE_LINEAR", [dest, index, count, values @ ..]) => table::piecewise(r, row, [*dest, *index, *count], values)?,
        ("READ_ADC", [name, refs @ ..]) => read_adc(r, *name, refs)?,
        ("SET_PWM", [duty, hertz, output @ ..]) => set_pwm(r, *duty, *hertz, output)?,
        ("UART_RECV", [name, rest @ ..]) => {
            let (name, rest) = (r.integer(keyword, *name), uart(r, rest));
            Element::UartRecv { name: name?, rest: rest? }
        }
        ("UART_SEND", [name, rest @ ..]) => {
            let (name, rest) = (r.integer(keyword, *name), uart(r, rest));
            Element::UartSend { name: name?, rest: rest? }
        }
        ("PERSIST", [name]) => Element::Persist { name: r.integer(keyword, *name)? },
        ("FORMATTED_STRING", [var, rest @ ..]) => table::string(r, line, row, *var, rest)?,
        // The counts were checked against the rows, so every row is caught above.
        _ => return None,
    })
}

fn contacts(r: &mut Reader<'_>, name: Token<'_>, flags: &[Token<'_>]) -> Option<Element> {
    let name =
        bit(r, name, &['X', 'Y', 'R'], codes::CONTACT_KIND, "CONTACTS", "test an integer with EQU, GEQ or the like");
    let flags = all_flags(r, flags, &["negated", "set1"]);
    let (name, flags) = (name?, flags?);
    Some(Element::Contacts { name, negated: flags.first() == Some(&1), set1: flags.get(1).copied() })
}

fn coil(r: &mut Reader<'_>, name: Token<'_>, flags: &[Token<'_>]) -> Option<Element> {
    let name =
        bit(r, name, &['Y', 'R'], codes::COIL_KIND, "COIL", "write an integer with MOVE; inputs cannot be written");
    let flags = all_flags(r, flags, &["negated", "set", "reset", "ttrigger"]);
    let (name, flags) = (name?, flags?);
    let is = |i: usize| flags.get(i) == Some(&1);
    Some(Element::Coil { name, negated: is(0), set: is(1), reset: is(2), ttrigger: flags.get(3).copied() })
}

fn bit(
    r: &mut Reader<'_>,
    token: Token<'_>,
    letters: &[char],
    code: &'static str,
    who: &str,
    hint: &str,
) -> Option<String> {
    let name = r.name(token)?;
    if name.starts_with(['X', 'Y', 'R']) {
        r.use_as_bit(&name);
    }
    if !name.starts_with(letters) {
        let wanted: Vec<String> = letters.iter().map(|l| format!("{l}..")).collect();
        r.error(code, token.pos, format!("{who} needs a name {}, found {}", wanted.join(" or "), shown(&name)), hint);
        return None;
    }
    Some(name)
}

/// All flags are read, so that every wrong one is told.
fn all_flags(r: &mut Reader<'_>, tokens: &[Token<'_>], names: &[&str]) -> Option<Vec<u32>> {
    let read: Vec<Option<u32>> =
        tokens.iter().zip(names).map(|(t, n)| r.small(*t, &format!("the flag `{n}`"), 0, 1)).collect();
    read.into_iter().collect()
}

fn timer(
    r: &mut Reader<'_>,
    kind: TimerKind,
    keyword: &'static str,
    name: Token<'_>,
    rest: &[Token<'_>],
) -> Option<Element> {
    let name = r.integer(keyword, name);
    let delay = rest.first().and_then(|t| ranged(r, keyword, *t, "the delay in microseconds", 0, 1_000_000_000_000));
    let adjust = rest.get(1).map(|t| operand(r, keyword, *t));
    Some(Element::Timer { kind, name: name?, delay: delay?, adjust: optional(adjust)? })
}

fn counter(
    r: &mut Reader<'_>,
    kind: CounterKind,
    keyword: &'static str,
    name: Token<'_>,
    rest: &[Token<'_>],
) -> Option<Element> {
    let name = r.integer(keyword, name);
    let max = rest.first().and_then(|t| constant(r, keyword, *t, "the counter's limit"));
    let init = rest.get(1).map(|t| operand(r, keyword, *t));
    let input = rest.get(2).map(|t| match t.text {
        "/" => Some('/'),
        "\\" => Some('\\'),
        "-" => Some('-'),
        "o" => Some('o'),
        other => {
            let cause = format!("the counter's input kind is `{}`, allowed are / \\ - o", shown(other));
            r.error(codes::OUT_OF_RANGE, t.pos, cause, "write / for rising edges");
            None
        }
    });
    Some(Element::Counter { kind, name: name?, max: max?, init: optional(init)?, input: optional(input)? })
}

fn math(r: &mut Reader<'_>, op: MathOp, keyword: &'static str, args: [Token<'_>; 3]) -> Option<Element> {
    let [dest, op1, op2] = args;
    let (dest, op1, op2) = (target(r, keyword, dest), operand(r, keyword, op1), operand(r, keyword, op2));
    Some(Element::Math { op, dest: dest?, op1: op1?, op2: op2? })
}

fn compare(r: &mut Reader<'_>, op: CompareOp, keyword: &'static str, args: [Token<'_>; 2]) -> Option<Element> {
    let [op1, op2] = args;
    let (op1, op2) = (operand(r, keyword, op1), operand(r, keyword, op2));
    Some(Element::Compare { op, op1: op1?, op2: op2? })
}

fn read_adc(r: &mut Reader<'_>, token: Token<'_>, refs: &[Token<'_>]) -> Option<Element> {
    let name = r.integer("READ_ADC", token);
    let refs = refs.first().map(|t| r.small(*t, "the reference selection", 0, 255));
    let name = name?;
    if !name.starts_with('A') {
        let cause = format!("READ_ADC needs a name A.., found {}", shown(&name));
        r.error(codes::BAD_NAME, token.pos, cause, "let the name of the analog input begin with A");
        return None;
    }
    Some(Element::ReadAdc { name, refs: optional(refs)? })
}

fn set_pwm(r: &mut Reader<'_>, duty: Token<'_>, hertz: Token<'_>, output: &[Token<'_>]) -> Option<Element> {
    let duty = operand(r, "SET_PWM", duty);
    let hertz = ranged(r, "SET_PWM", hertz, "the frequency in Hz", 1, 100_000_000);
    let output = match output {
        [name, resolution] => r.name(*name).map(|n| Some((n, resolution.text.to_owned()))),
        _ => Some(None),
    };
    Some(Element::SetPwm { duty: duty?, hertz: hertz?, output: output? })
}

fn uart(r: &mut Reader<'_>, rest: &[Token<'_>]) -> Option<Option<(u32, u32)>> {
    match rest {
        [bytes, wait] => {
            let (bytes, wait) =
                (r.small(*bytes, "the number of bytes", 1, 255), r.small(*wait, "the flag `wait`", 0, 1));
            Some(Some((bytes?, wait?)))
        }
        _ => Some(None),
    }
}

/// `Some(None)` when absent, `None` when present and wrong.
fn optional<T>(read: Option<Option<T>>) -> Option<Option<T>> {
    match read {
        None => Some(None),
        Some(value) => value.map(Some),
    }
}

/// The variable that an element writes.
pub(crate) fn target(r: &mut Reader<'_>, keyword: &'static str, token: Token<'_>) -> Option<String> {
    if lex::looks_like_number(token.text) {
        let cause = format!("{keyword} cannot write to the constant {}", shown(token.text));
        r.error(
            codes::CONSTANT_TARGET,
            token.pos,
            cause,
            "the first argument is the variable that receives the result",
        );
        return None;
    }
    r.integer(keyword, token)
}

/// A variable or a constant.
pub(crate) fn operand(r: &mut Reader<'_>, keyword: &'static str, token: Token<'_>) -> Option<Operand> {
    constant(r, keyword, token, "a constant")
}

/// A variable or a constant of the dialect's range; `what` names it in messages.
fn constant(r: &mut Reader<'_>, keyword: &'static str, token: Token<'_>, what: &str) -> Option<Operand> {
    let (low, high) = r.constants();
    ranged(r, keyword, token, what, low, high)
}

fn ranged(
    r: &mut Reader<'_>,
    keyword: &'static str,
    token: Token<'_>,
    what: &str,
    low: i64,
    high: i64,
) -> Option<Operand> {
    if lex::looks_like_number(token.text) {
        let value = r.number(token, what, low, high)?;
        return Some(Operand::Const { value, text: token.text.to_owned() });
    }
    r.integer(keyword, token).map(Operand::Var)
}

/// Undoes the escapes of COMMENT: `\n`, `\r` and `\\`; any other backslash stands for itself.
fn unescape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        let rest = chars.as_str();
        match (c, rest.chars().next()) {
            ('\\', Some(next @ ('n' | 'r' | '\\'))) => {
                chars.next();
                out.push(match next {
                    'n' => '\n',
                    'r' => '\r',
                    other => other,
                });
            }
            (c, _) => out.push(c),
        }
    }
    out
}

/// Place that spans from the first to the last of some words.
pub(crate) fn span(first: Pos, last: Pos) -> Pos {
    Pos::new(first.line, first.column, (last.column + last.width).saturating_sub(first.column))
}
