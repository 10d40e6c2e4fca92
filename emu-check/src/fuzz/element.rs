//! Random elements: constants at boundaries, few names so that they are shared, destinations that are their own operands.

use ladder::format::{Piece, pieces};
use ladder::{CompareOp, CounterKind, Element, MathOp, Operand, TimerKind};

use super::draw::Draw;
use super::style::Sort;

/// Values at which something happens: signs, bytes, words, digits.
#[rustfmt::skip]
const BOUNDARIES: &[i64] = &[
    0, 1, -1, 2, -2, 3, 5, 9, 10, 99, 100, 101, 127, 128, -127, -128, -129, 255, 256, -255, -256, -257, 1023, 1024, 9_999, 10_000,
    32_766, 32_767, -32_767, -32_768,
];

/// The same for integers of more than two bytes.
#[rustfmt::skip]
const WIDE: &[i64] = &[
    32_768, -32_769, 65_535, 65_536, -65_536, 99_999, 8_388_607, 8_388_608, -8_388_608, -8_388_609, 16_777_216,
    2_147_483_646, 2_147_483_647, -2_147_483_647, -2_147_483_648,
];

/// Texts of FORMATTED_STRING, as typed.
const TEXTS: &[&str] = &[
    "a",
    "ab\\r\\n",
    "\\5",
    "x\\-3yz",
    "\\-1",
    "=\\4;",
    "\\xff\\-5",
    "hello world",
    "\\2!",
    "\\1",
    "\\\\\\t",
    "\\-5\\r\\n",
    "\\x00\\x80",
    "T=\\3 s\\r",
    "",
];

/// An element of the given sort, or of another where a name is lacking.
pub(super) fn element(draw: &mut Draw, sort: Sort) -> Element {
    match sort {
        Sort::Contact => contact(draw),
        Sort::Compare => {
            use CompareOp::{Equ, Geq, Grt, Leq, Les, Neq};
            let op = draw.pick(&[Equ, Neq, Grt, Geq, Les, Leq]);
            let (op1, op2) = (operand(draw), operand(draw));
            Element::Compare { op, op1, op2 }
        }
        Sort::OneShot => draw.pick(&[Element::Osr, Element::Osf]),
        Sort::Timer => timer(draw),
        Sort::Counter => counter(draw),
        Sort::Wire => {
            draw.pick(&[Element::Short, Element::Short, Element::Open, Element::Comment("Without meaning.".to_owned())])
        }
        Sort::Send => Element::UartSend { name: integer(draw), rest: None },
        Sort::Receive => Element::UartRecv { name: integer(draw), rest: None },
        Sort::Text => text(draw),
        Sort::Coil => coil(draw),
        Sort::Res => res(draw),
        Sort::Move => Element::Move { dest: integer(draw), src: operand(draw) },
        Sort::Math => {
            let op = draw.pick(&[MathOp::Add, MathOp::Sub, MathOp::Mul, MathOp::Div]);
            let (dest, op1, op2) = (integer(draw), operand(draw), operand(draw));
            Element::Math { op, dest, op1, op2 }
        }
        Sort::Shift => Element::ShiftRegister { name: "s".to_owned(), stages: 1 + draw.rng.below(5) as u32 },
        Sort::Table => table(draw),
        Sort::Curve => curve(draw),
        Sort::Adc => Element::ReadAdc { name: draw.pick(&draw.style.analog.clone()), refs: None },
        Sort::Pwm => {
            let hertz = fixed(draw.style.hertz as i64);
            let duty = if draw.rng.one_in(3) { fixed(draw.rng.below(101) as i64) } else { operand(draw) };
            Element::SetPwm { duty, hertz, output: None }
        }
        Sort::Persist => Element::Persist { name: integer(draw) },
        Sort::Master => Element::MasterRelay,
    }
}

fn contact(draw: &mut Draw) -> Element {
    let from = match draw.rng.below(5) {
        0 | 1 => draw.style.inputs.clone(),
        2 => draw.style.outputs.clone(),
        _ => draw.style.relays.clone(),
    };
    Element::Contacts { name: draw.pick(&from), negated: draw.rng.one_in(2), set1: None }
}

fn coil(draw: &mut Draw) -> Element {
    let from = if draw.rng.one_in(2) { draw.style.outputs.clone() } else { draw.style.relays.clone() };
    let latch = draw.rng.one_in(draw.style.latch);
    let set = latch && draw.rng.one_in(2);
    let negated = !latch && draw.rng.one_in(4);
    Element::Coil { name: draw.pick(&from), negated, set, reset: latch && !set, ttrigger: None }
}

/// A timer or counter: any name, or on a machine with modules the next that has no element yet.
fn module(draw: &mut Draw, names: &[String]) -> Option<String> {
    if !draw.bits() {
        return Some(draw.pick(names));
    }
    let name = names.iter().find(|name| !draw.modules.contains(name))?.clone();
    draw.modules.push(name.clone());
    Some(name)
}

fn timer(draw: &mut Draw) -> Element {
    let kind = draw.pick(&[TimerKind::Ton, TimerKind::Tof, TimerKind::Rto]);
    let Some(name) = module(draw, &draw.style.timers.clone()) else { return contact(draw) };
    // P from 1 scan to a few within reach of a check; now and then the most.
    let scans = match draw.rng.below(12) {
        0 => 32_767,
        1 => 256 + draw.rng.below(3) as i64,
        2..5 => 1,
        _ => 1 + draw.rng.below(30) as i64,
    };
    let cycle = draw.style.cycle_us as i64;
    let part = if draw.rng.one_in(4) { draw.rng.below(cycle as u64) as i64 } else { 0 };
    let written = draw.five() && draw.rng.one_in(3);
    let adjust = if written { draw.pick(&[-1, 0, 1]) } else { -i64::from(!draw.five()) };
    let delay = fixed((scans - adjust) * cycle + part);
    Element::Timer { kind, name, delay, adjust: written.then(|| fixed(adjust)) }
}

fn counter(draw: &mut Draw) -> Element {
    let kind = draw.pick(&[CounterKind::Ctu, CounterKind::Ctd, CounterKind::Ctc]);
    let Some(name) = module(draw, &draw.style.counters.clone()) else { return contact(draw) };
    let five = draw.five();
    let small = draw.rng.below(8) as i64;
    let max = match draw.rng.below(3) {
        0 => draw.pick(BOUNDARIES).min(32_766),
        1 if five && !draw.bits() => return five_counter(draw, kind, name),
        _ => small,
    };
    let input = if five && draw.rng.one_in(2) { Some(draw.pick(&['/', '\\', '-', 'o'])) } else { None };
    Element::Counter { kind, name, max: fixed(max), init: input.map(|_| fixed(0)), input }
}

/// A counter as only LDmicro 5 has them: with a start value, and with a limit that may be an integer.
fn five_counter(draw: &mut Draw, kind: CounterKind, name: String) -> Element {
    let (max, init) = (operand(draw), constant(draw));
    let input = Some(draw.pick(&['/', '\\', '-', 'o']));
    Element::Counter { kind, name, max, init: Some(fixed(init)), input }
}

fn res(draw: &mut Draw) -> Element {
    let mut names = draw.style.timers.clone();
    names.extend(draw.style.counters.iter().cloned());
    if !draw.bits() && draw.rng.one_in(4) {
        names.clone_from(&draw.style.integers);
    }
    Element::Res { name: draw.pick(&names) }
}

fn text(draw: &mut Draw) -> Element {
    let text = draw.pick(TEXTS);
    let number = pieces(text, true).is_ok_and(|all| all.iter().any(|piece| matches!(piece, Piece::Digit { .. })));
    let var = number.then(|| integer(draw));
    Element::FormattedString { var, text: text.to_owned(), quoted: draw.five() }
}

fn table(draw: &mut Draw) -> Element {
    let (dest, index) = (integer(draw), operand(draw));
    let count = if draw.rng.one_in(10) { 1 + draw.rng.below(40) } else { 1 + draw.rng.below(8) };
    let values = (0..count).map(|_| constant(draw)).collect();
    Element::LookUpTable { dest, index, as_string: false, values }
}

/// Points with slopes that 16 bits can compute.
fn curve(draw: &mut Draw) -> Element {
    let (dest, index) = (integer(draw), operand(draw));
    let mut at = (draw.pick(&[-100, 0, 10, -32_768, 32_700, 1_000]), draw.pick(&[0, 100, -5, 32_000, -32_768]));
    let mut points = vec![at];
    for _ in 0..1 + draw.rng.below(4) {
        let dx = if draw.rng.one_in(5) { 1 + draw.rng.below(2_000) } else { 1 + draw.rng.below(40) } as i64;
        let steepest = 32_767 / dx;
        let dy = draw.pick(&[0, 1, -1, dx, -dx, 2 * dx, 7, -13, steepest, -steepest]).clamp(-steepest, steepest);
        let next = (at.0 + dx, at.1 + dy);
        if next.0 <= 32_767 && (-32_768..=32_767).contains(&next.1) {
            points.push(next);
            at = next;
        }
    }
    if points.len() < 2 {
        points.push((at.0 + 1, at.1));
    }
    Element::PiecewiseLinear { dest, index, points }
}

/// Something that can be computed with and written.
fn integer(draw: &mut Draw) -> String {
    draw.pick(&draw.style.integers.clone())
}

/// An integer or a constant.
fn operand(draw: &mut Draw) -> Operand {
    if draw.rng.one_in(draw.style.constant) { fixed(constant(draw)) } else { Operand::Var(integer(draw)) }
}

fn constant(draw: &mut Draw) -> i64 {
    let five = draw.five();
    let (low, high) = if five { (-(1 << 31), (1 << 31) - 1) } else { (-32_768, 32_767) };
    let value = match draw.rng.below(6) {
        0 => draw.rng.below(40) as i64 - 20,
        1 => i64::from(draw.rng.next_u64() as i16),
        2 if five => draw.pick(WIDE),
        3 if !draw.constants.is_empty() => draw.pick(&draw.constants.clone()) + draw.pick(&[-1, 0, 1]),
        _ => draw.pick(BOUNDARIES),
    };
    let value = value.clamp(low, high);
    draw.constants.push(value);
    value
}

/// A constant as operand.
fn fixed(value: i64) -> Operand {
    Operand::Const { value, text: value.to_string() }
}
