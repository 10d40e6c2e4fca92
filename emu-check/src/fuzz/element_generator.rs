//! Generates random elements: constants near boundaries, few names so that they are shared, and destinations
//! that are also operands.

use ladder::format::{StringPiece, split_format_string};
use ladder::{
    BusOp, BusTransfer, CompareOp, CounterKind, CurvePoint, Element, LadderOperand, MathOp, PwmChoice, SegmentDisplay,
    SerialTransfer, ShiftOp, TimerKind, UnaryOp,
};

use super::generator::ProgramGenerator;
use super::program_style::{ElementSort, ProgramProfile};

/// Boundary values: of signs, bytes, words and decimal digits.
#[rustfmt::skip]
const BOUNDARIES: &[i64] = &[
    0, 1, -1, 2, -2, 3, 5, 9, 10, 99, 100, 101, 127, 128, -127, -128, -129, 255, 256, -255, -256, -257, 1023, 1024, 9_999, 10_000,
    32_766, 32_767, -32_767, -32_768,
];

/// Boundary values of integers of more than two bytes.
#[rustfmt::skip]
const WIDE_BOUNDARIES: &[i64] = &[
    32_768, -32_769, 65_535, 65_536, -65_536, 99_999, 8_388_607, 8_388_608, -8_388_608, -8_388_609, 16_777_216,
    2_147_483_646, 2_147_483_647, -2_147_483_647, -2_147_483_648,
];

/// Texts of FORMATTED_STRING as they are written in a program.
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

/// A random element of the given sort, or of another sort if no name is left.
pub(super) fn random_element(draw: &mut ProgramGenerator, sort: ElementSort) -> Element {
    match sort {
        ElementSort::Contact => random_contact(draw),
        ElementSort::Compare => {
            use CompareOp::{Equ, Geq, Grt, Leq, Les, Neq};
            let op = draw.pick(&[Equ, Neq, Grt, Geq, Les, Leq]);
            let (op1, op2) = (random_operand(draw), random_operand(draw));
            Element::Compare { op, op1, op2 }
        }
        ElementSort::OneShot => random_one_shot(draw),
        ElementSort::Timer => random_timer(draw),
        ElementSort::Counter => random_counter(draw),
        ElementSort::Wire => {
            draw.pick(&[Element::Short, Element::Short, Element::Open, Element::Comment("Without meaning.".to_owned())])
        }
        ElementSort::Send => {
            let name = random_integer(draw);
            let rest = random_transfer(draw).map(|rest| SerialTransfer { wait: u32::from(draws_wait(draw)), ..rest });
            Element::UartSend { name, rest }
        }
        ElementSort::Receive => {
            let name = random_integer(draw);
            let rest = random_transfer(draw);
            let rest = rest.map(|rest| SerialTransfer { wait: u32::from(draw.rng.one_in(3)), ..rest });
            Element::UartRecv { name, rest }
        }
        ElementSort::Text => random_text(draw),
        ElementSort::Coil => random_coil(draw),
        ElementSort::Res => random_reset(draw),
        ElementSort::Move => Element::Move { dest: random_integer(draw), src: random_operand(draw) },
        ElementSort::Math => {
            let op = draw.pick(&[MathOp::Add, MathOp::Sub, MathOp::Mul, MathOp::Div]);
            let (dest, op1, op2) = (random_integer(draw), random_operand(draw), random_operand(draw));
            Element::Math { op, dest, op1, op2 }
        }
        ElementSort::BitTest => {
            Element::BitTest { name: random_integer(draw), bit: random_bit_number(draw), value: draw.rng.one_in(2) }
        }
        ElementSort::Bits => random_bit_element(draw),
        ElementSort::Line => draw.pick(&[Element::UartRecvAvail, Element::UartSendReady]),
        ElementSort::Pulse => random_pulse_element(draw),
        ElementSort::Shift => Element::ShiftRegister { name: "s".to_owned(), stages: 1 + draw.rng.below(5) as u32 },
        ElementSort::Table => random_table(draw),
        ElementSort::Curve => random_curve(draw),
        ElementSort::Adc => {
            let name = draw.pick(&draw.style.analog.clone());
            // One reference for each input; all chips have the supply.
            let refs = draw.is_ldmicro5().then(|| u32::from(name == "Ab"));
            Element::ReadAdc { name, refs }
        }
        ElementSort::Pwm => {
            let hertz = constant_operand(draw.style.hertz as i64);
            let duty =
                if draw.rng.one_in(3) { constant_operand(draw.rng.below(101) as i64) } else { random_operand(draw) };
            let output = (draw.style.profile == ProgramProfile::Outputs)
                .then(|| PwmChoice { name: draw.pick(&["Pa", "Pb"]).to_owned(), resolution: "0-100".to_owned() });
            Element::SetPwm { duty, hertz, output }
        }
        ElementSort::Bus => random_bus_element(draw),
        ElementSort::Persist => Element::Persist { name: random_integer(draw) },
        ElementSort::Master => Element::MasterRelay,
    }
}

/// Whether UART_SEND waits: a few, where a scan has the time for some bytes.
fn draws_wait(draw: &mut ProgramGenerator) -> bool {
    let rate = draw.style.baud.unwrap_or(0).saturating_mul(draw.style.cycle_us);
    // Twice four bytes of ten bits.
    let waits = rate >= 95_000_000 && draw.transfers < 2 && draw.rng.one_in(2);
    draw.transfers += u32::from(waits);
    waits
}

/// How many bytes UART_SEND or UART_RECV transfers; the generator makes them fit the
/// integer.
fn random_transfer(draw: &mut ProgramGenerator) -> Option<SerialTransfer> {
    (draw.is_ldmicro5() && draw.rng.one_in(2)).then(|| SerialTransfer { bytes: 1 + draw.rng.below(4) as u32, wait: 0 })
}

/// What LDmicro 5 does with the bits of integers.
fn random_bit_element(draw: &mut ProgramGenerator) -> Element {
    let (dest, src) = (random_integer(draw), random_operand(draw));
    match draw.rng.below(12) {
        8 | 9 => {
            use SegmentDisplay::{Fourteen, Nine, Seven, Sixteen};
            let display = draw.pick(&[Seven, Nine, Fourteen, Sixteen]);
            let code = constant_operand(draw.rng.below(180) as i64);
            let src = if draw.rng.one_in(3) { code } else { src };
            Element::Segments { display, dest, src, common: draw.pick(&['C', 'A']) }
        }
        10 if draw.rng.one_in(4) => Element::SeedRandom { dest, src },
        10 => Element::Random { dest },
        11 => {
            let time = constant_operand(draw.rng.below(1_000_000) as i64);
            Element::TimeValue { is_scans: draw.rng.one_in(2), dest, time }
        }
        0 | 1 => {
            let op = draw.pick(&[MathOp::Mod, MathOp::And, MathOp::Or, MathOp::Xor]);
            Element::Math { op, dest, op1: src, op2: random_operand(draw) }
        }
        2 | 3 => {
            use UnaryOp::{BcdToBin, BinToBcd, Neg, Not, Opposite, Swap};
            Element::Unary { op: draw.pick(&[Not, Neg, Swap, Opposite, BinToBcd, BcdToBin]), dest, src }
        }
        4 | 5 => {
            let op = draw.pick(&[ShiftOp::Shl, ShiftOp::Shr, ShiftOp::Sr0, ShiftOp::Rol, ShiftOp::Ror]);
            // Up to the bits that every operand has.
            let constant = constant_operand(draw.rng.below(9) as i64);
            let count = if draw.rng.one_in(2) { constant } else { LadderOperand::Var(random_integer(draw)) };
            Element::Shift { op, dest, src, count }
        }
        6 => Element::BitWrite { name: dest, bit: random_bit_number(draw), value: draw.rng.one_in(2) },
        _ => {
            let mut targets = [0, 1, 2, 3, 4, 5, 6, 7];
            targets.iter_mut().for_each(|to| {
                if draw.rng.one_in(2) {
                    *to = draw.rng.below(8) as u8;
                }
            });
            Element::Bus { dest, src, targets }
        }
    }
}

/// Elements on a bus that a program may have.
const MAX_TRANSFERS: u32 = 6;

/// SPI, SPI_WR, I2C_RD and I2C_WR; a transfer takes some time, so the bus is not slow.
fn random_bus_element(draw: &mut ProgramGenerator) -> Element {
    if draw.transfers >= MAX_TRANSFERS {
        return Element::Move { dest: random_integer(draw), src: random_operand(draw) };
    }
    draw.transfers += 1;
    let all = if draw.style.uses_i2c { [BusOp::I2cRead, BusOp::I2cWrite] } else { [BusOp::Spi, BusOp::SpiText] };
    let op = draw.pick(&all);
    let sends = matches!(op, BusOp::Spi | BusOp::I2cWrite);
    let receives = op == BusOp::I2cRead || op == BusOp::Spi && draw.rng.one_in(2);
    let register = match draw.rng.below(3) {
        0 => LadderOperand::Var(random_integer(draw)),
        _ => constant_operand(draw.rng.below(256) as i64),
    };
    Element::BusTransfer(Box::new(BusTransfer {
        op,
        name: "bus".to_owned(),
        send: sends.then(|| random_operand(draw)),
        text: if op == BusOp::SpiText { draw.pick(&["a", "Hi!", "~0"]).to_owned() } else { String::new() },
        recv: receives.then(|| random_integer(draw)),
        mode: "Master".to_owned(),
        device: constant_operand(if op.is_i2c() { draw.rng.below(128) as i64 } else { 0 }),
        register: if op.is_i2c() { register } else { constant_operand(8) },
        first: "MSB_FIRST".to_owned(),
        hertz: draw.pick(&[0, 100_000, 400_000]),
    }))
}

/// PULSER, NPULSE, STEPPER and QUAD_ENCOD: mostly short ones.
fn random_pulse_element(draw: &mut ProgramGenerator) -> Element {
    let few = |draw: &mut ProgramGenerator| match draw.rng.below(5) {
        0 => random_operand(draw),
        _ => constant_operand(draw.rng.below(5) as i64),
    };
    let [high, low, accel, count] = [(); 4].map(|()| few(draw));
    match draw.rng.below(5) {
        2 => Element::NpulseOff,
        3 => {
            let most = 500_000 / draw.style.cycle_us.max(1);
            let hertz = constant_operand((most / (1 + draw.rng.below(4))).max(1) as i64);
            Element::Npulse { count, hertz, coil: draw.pick(&draw.style.outputs.clone()) }
        }
        0 => Element::Pulser { high, low, accel, count, coil: draw.pick(&draw.style.outputs.clone()) },
        1 => {
            let (name, coil) = (draw.pick(&["p", "q"]).to_owned(), draw.pick(&draw.style.outputs.clone()));
            Element::Stepper { name, max: high, period: low, size: 0, graph: 0, coil }
        }
        _ => {
            let inputs = draw.style.inputs.clone();
            Element::QuadEncod {
                counter: random_integer(draw),
                interrupt: 0,
                inputs: [draw.pick(&inputs), draw.pick(&inputs)],
                zero: draw.rng.one_in(2).then(|| draw.pick(&inputs)),
                dir: draw.rng.one_in(2).then(|| draw.pick(&draw.style.outputs.clone())),
                zero_kind: draw.pick(&['/', '\\', '-', 'o']),
                turn: draw.pick(&[0, 1, 2, 7, 200]),
            }
        }
    }
}

/// A bit of an integer, or one just beyond its ends.
fn random_bit_number(draw: &mut ProgramGenerator) -> LadderOperand {
    match draw.rng.below(4) {
        0 => constant_operand(draw.pick(&[-1, 7, 8, 15, 16, 31, 32])),
        1 | 2 => constant_operand(draw.rng.below(16) as i64),
        _ => LadderOperand::Var(random_integer(draw)),
    }
}

fn random_contact(draw: &mut ProgramGenerator) -> Element {
    let from = match draw.rng.below(5) {
        0 | 1 => draw.style.inputs.clone(),
        2 => draw.style.outputs.clone(),
        _ => draw.style.relays.clone(),
    };
    Element::Contacts { name: draw.pick(&from), negated: draw.rng.one_in(2), set1: None }
}

fn random_coil(draw: &mut ProgramGenerator) -> Element {
    let from = if draw.rng.one_in(2) { draw.style.outputs.clone() } else { draw.style.relays.clone() };
    let latch = draw.rng.one_in(draw.style.latch);
    let set = latch && draw.rng.one_in(2);
    let negated = !latch && draw.rng.one_in(4);
    let ttrigger = (draw.is_ldmicro5() && draw.rng.one_in(8)).then_some(1);
    Element::Coil { name: draw.pick(&from), negated, set, reset: latch && !set, ttrigger }
}

fn random_one_shot(draw: &mut ProgramGenerator) -> Element {
    let all = [Element::Osr, Element::Osf, Element::Odr, Element::Odf, Element::Osl, Element::Osc];
    // LDmicro 2.3 has the first two only.
    draw.pick(if draw.is_ldmicro5() { &all } else { &all[..2] })
}

/// The name of a timer or counter: any name, or on a machine with modules the next one without an element.
fn module_name(draw: &mut ProgramGenerator, names: &[String]) -> Option<String> {
    if !draw.is_module_machine() {
        return Some(draw.pick(names));
    }
    let name = names.iter().find(|name| !draw.modules.contains(name))?.clone();
    draw.modules.push(name.clone());
    Some(name)
}

fn random_timer(draw: &mut ProgramGenerator) -> Element {
    use TimerKind::{Rtl, Rto, Tcy, Thi, Tlo, Tof, Ton};
    let newer = draw.is_ldmicro5() && !draw.is_module_machine();
    let all = [Ton, Tof, Rto, Rtl, Tcy, Thi, Tlo];
    let kind = draw.pick(if newer { &all } else { &all[..3] });
    let Some(name) = module_name(draw, &draw.style.timers.clone()) else { return random_contact(draw) };
    // The preset is mostly 1 to 30 scans, which a check reaches; sometimes it is near 256 or the maximum.
    let scans = match draw.rng.below(12) {
        0 => 32_767,
        1 => 256 + draw.rng.below(3) as i64,
        2..5 => 1,
        _ => 1 + draw.rng.below(30) as i64,
    };
    if newer && draw.rng.one_in(6) {
        // A delay in a variable counts scans.
        return Element::Timer { kind, name, delay: LadderOperand::Var(random_integer(draw)), adjust: None };
    }
    let cycle = draw.style.cycle_us as i64;
    let part = if draw.rng.one_in(4) { draw.rng.below(cycle as u64) as i64 } else { 0 };
    let written = draw.is_ldmicro5() && draw.rng.one_in(3);
    let adjust = if written { draw.pick(&[-1, 0, 1]) } else { -i64::from(!draw.is_ldmicro5()) };
    let delay = constant_operand((scans - adjust) * cycle + part);
    Element::Timer { kind, name, delay, adjust: written.then(|| constant_operand(adjust)) }
}

fn random_counter(draw: &mut ProgramGenerator) -> Element {
    // AP101 has no circular counter with a carry.
    let kinds = match (draw.is_ldmicro5(), draw.is_module_machine()) {
        (true, true) => &[CounterKind::Ctu, CounterKind::Ctd][..],
        (true, false) => &[CounterKind::Ctu, CounterKind::Ctd, CounterKind::Ctc, CounterKind::Ctr],
        (false, _) => &[CounterKind::Ctu, CounterKind::Ctd, CounterKind::Ctc],
    };
    let kind = draw.pick(kinds);
    let Some(name) = module_name(draw, &draw.style.counters.clone()) else { return random_contact(draw) };
    let five = draw.is_ldmicro5();
    let small = draw.rng.below(8) as i64;
    let max = match draw.rng.below(3) {
        0 => draw.pick(BOUNDARIES).min(32_766),
        1 if five && !draw.is_module_machine() => return random_ldmicro5_counter(draw, kind, name),
        _ => small,
    };
    let input = if five && draw.rng.one_in(2) { Some(draw.pick(&['/', '\\', '-', 'o'])) } else { None };
    Element::Counter { kind, name, max: constant_operand(max), init: input.map(|_| constant_operand(0)), input }
}

/// A counter with features of LDmicro 5: a start value, and a limit that may be an integer symbol.
fn random_ldmicro5_counter(draw: &mut ProgramGenerator, kind: CounterKind, name: String) -> Element {
    let max = random_operand(draw);
    let init = if draw.rng.one_in(5) {
        LadderOperand::Var(random_integer(draw))
    } else {
        constant_operand(random_constant(draw))
    };
    let input = Some(draw.pick(&['/', '\\', '-', 'o']));
    Element::Counter { kind, name, max, init: Some(init), input }
}

fn random_reset(draw: &mut ProgramGenerator) -> Element {
    let mut names = draw.style.timers.clone();
    names.extend(draw.style.counters.iter().cloned());
    if !draw.is_module_machine() && draw.rng.one_in(4) {
        names.clone_from(&draw.style.integers);
    }
    Element::Res { name: draw.pick(&names) }
}

fn random_text(draw: &mut ProgramGenerator) -> Element {
    let text = draw.pick(TEXTS);
    let number = split_format_string(text, true)
        .is_ok_and(|all| all.iter().any(|piece| matches!(piece, StringPiece::Digit { .. })));
    let var = number.then(|| random_integer(draw));
    Element::FormattedString { var, text: text.to_owned(), quoted: draw.is_ldmicro5() }
}

fn random_table(draw: &mut ProgramGenerator) -> Element {
    let (dest, index) = (random_integer(draw), random_operand(draw));
    let count = if draw.rng.one_in(10) { 1 + draw.rng.below(40) } else { 1 + draw.rng.below(8) };
    let values = (0..count).map(|_| random_constant(draw)).collect();
    Element::LookUpTable { dest, index, as_string: false, values, name: None }
}

/// A PIECEWISE_LINEAR whose slopes can be computed in 16 bits.
fn random_curve(draw: &mut ProgramGenerator) -> Element {
    let (dest, index) = (random_integer(draw), random_operand(draw));
    let x = draw.pick(&[-100, 0, 10, -32_768, 32_700, 1_000]);
    let mut at = CurvePoint { x, y: draw.pick(&[0, 100, -5, 32_000, -32_768]) };
    let mut points = vec![at];
    for _ in 0..1 + draw.rng.below(4) {
        let dx = if draw.rng.one_in(5) { 1 + draw.rng.below(2_000) } else { 1 + draw.rng.below(40) } as i64;
        let steepest = 32_767 / dx;
        let dy = draw.pick(&[0, 1, -1, dx, -dx, 2 * dx, 7, -13, steepest, -steepest]).clamp(-steepest, steepest);
        let next = CurvePoint { x: at.x + dx, y: at.y + dy };
        if next.x <= 32_767 && (-32_768..=32_767).contains(&next.y) {
            points.push(next);
            at = next;
        }
    }
    if points.len() < 2 {
        points.push(CurvePoint { x: at.x + 1, y: at.y });
    }
    Element::PiecewiseLinear { dest, index, points, name: None }
}

/// The name of an integer that can be read and written.
fn random_integer(draw: &mut ProgramGenerator) -> String {
    draw.pick(&draw.style.integers.clone())
}

/// A random integer symbol or constant.
fn random_operand(draw: &mut ProgramGenerator) -> LadderOperand {
    if draw.rng.one_in(draw.style.constant) {
        constant_operand(random_constant(draw))
    } else {
        LadderOperand::Var(random_integer(draw))
    }
}

fn random_constant(draw: &mut ProgramGenerator) -> i64 {
    let five = draw.is_ldmicro5();
    let (low, high) = if five { (-(1 << 31), (1 << 31) - 1) } else { (-32_768, 32_767) };
    let value = match draw.rng.below(6) {
        0 => draw.rng.below(40) as i64 - 20,
        1 => i64::from(draw.rng.next_u64() as i16),
        2 if five => draw.pick(WIDE_BOUNDARIES),
        3 if !draw.constants.is_empty() => draw.pick(&draw.constants.clone()) + draw.pick(&[-1, 0, 1]),
        _ => draw.pick(BOUNDARIES),
    };
    let value = value.clamp(low, high);
    draw.constants.push(value);
    value
}

/// A constant as an operand.
fn constant_operand(value: i64) -> LadderOperand {
    LadderOperand::Const { value, text: value.to_string() }
}
