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
pub(super) fn random_element(generator: &mut ProgramGenerator, sort: ElementSort) -> Element {
    match sort {
        ElementSort::Contact => random_contact(generator),
        ElementSort::Compare => {
            use CompareOp::{Equ, Geq, Grt, Leq, Les, Neq};
            let op = generator.pick(&[Equ, Neq, Grt, Geq, Les, Leq]);
            let (op1, op2) = (random_operand(generator), random_operand(generator));
            Element::Compare { op, op1, op2 }
        }
        ElementSort::OneShot => random_one_shot(generator),
        ElementSort::Timer => random_timer(generator),
        ElementSort::Counter => random_counter(generator),
        ElementSort::Wire => generator.pick(&[
            Element::Short,
            Element::Short,
            Element::Open,
            Element::Comment("Without meaning.".to_owned()),
        ]),
        ElementSort::Send => {
            let name = random_integer(generator);
            let rest = random_transfer(generator)
                .map(|rest| SerialTransfer { wait: u32::from(draws_wait(generator)), ..rest });
            Element::UartSend { name, rest }
        }
        ElementSort::Receive => {
            let name = random_integer(generator);
            let rest = random_transfer(generator);
            let rest = rest.map(|rest| SerialTransfer { wait: u32::from(generator.rng.one_in(3)), ..rest });
            Element::UartRecv { name, rest }
        }
        ElementSort::Text => random_text(generator),
        ElementSort::Coil => random_coil(generator),
        ElementSort::Res => random_reset(generator),
        ElementSort::Move => Element::Move { dest: random_integer(generator), src: random_operand(generator) },
        ElementSort::Math => {
            let op = generator.pick(&[MathOp::Add, MathOp::Sub, MathOp::Mul, MathOp::Div]);
            let (dest, op1, op2) = (random_integer(generator), random_operand(generator), random_operand(generator));
            Element::Math { op, dest, op1, op2 }
        }
        ElementSort::BitTest => Element::BitTest {
            name: random_integer(generator),
            bit: random_bit_number(generator),
            value: generator.rng.one_in(2),
        },
        ElementSort::Bits => random_bit_element(generator),
        ElementSort::Line => generator.pick(&[Element::UartRecvAvail, Element::UartSendReady]),
        ElementSort::Pulse => random_pulse_element(generator),
        ElementSort::Shift => {
            Element::ShiftRegister { name: "s".to_owned(), stages: 1 + generator.rng.below(5) as u32 }
        }
        ElementSort::Table => random_table(generator),
        ElementSort::Curve => random_curve(generator),
        ElementSort::Adc => {
            let name = generator.pick(&generator.style.analog.clone());
            // One reference for each input; all chips have the supply.
            let refs = generator.is_ldmicro5().then(|| u32::from(name == "Ab"));
            Element::ReadAdc { name, refs }
        }
        ElementSort::Pwm => {
            let hertz = constant_operand(generator.style.hertz as i64);
            let duty = if generator.rng.one_in(3) {
                constant_operand(generator.rng.below(101) as i64)
            } else {
                random_operand(generator)
            };
            let output = (generator.style.profile == ProgramProfile::Outputs)
                .then(|| PwmChoice { name: generator.pick(&["Pa", "Pb"]).to_owned(), resolution: "0-100".to_owned() });
            Element::SetPwm { duty, hertz, output }
        }
        ElementSort::Bus => random_bus_element(generator),
        ElementSort::Persist => Element::Persist { name: random_integer(generator) },
        ElementSort::Master => Element::MasterRelay,
    }
}

/// Returns true if UART_SEND waits: a few, where a scan has the time for some bytes.
fn draws_wait(generator: &mut ProgramGenerator) -> bool {
    let rate = generator.style.baud.unwrap_or(0).saturating_mul(generator.style.cycle_us);
    // Twice four bytes of ten bits.
    let waits = rate >= 95_000_000 && generator.transfers < 2 && generator.rng.one_in(2);
    generator.transfers += u32::from(waits);
    waits
}

/// How many bytes UART_SEND or UART_RECV transfers; the generator makes them fit the
/// integer.
fn random_transfer(generator: &mut ProgramGenerator) -> Option<SerialTransfer> {
    (generator.is_ldmicro5() && generator.rng.one_in(2))
        .then(|| SerialTransfer { bytes: 1 + generator.rng.below(4) as u32, wait: 0 })
}

/// What LDmicro 5 does with the bits of integers.
fn random_bit_element(generator: &mut ProgramGenerator) -> Element {
    let (dest, src) = (random_integer(generator), random_operand(generator));
    match generator.rng.below(12) {
        8 | 9 => {
            use SegmentDisplay::{Fourteen, Nine, Seven, Sixteen};
            let display = generator.pick(&[Seven, Nine, Fourteen, Sixteen]);
            let code = constant_operand(generator.rng.below(180) as i64);
            let src = if generator.rng.one_in(3) { code } else { src };
            Element::Segments { display, dest, src, common: generator.pick(&['C', 'A']) }
        }
        10 if generator.rng.one_in(4) => Element::SeedRandom { dest, src },
        10 => Element::Random { dest },
        11 => {
            let time = constant_operand(generator.rng.below(1_000_000) as i64);
            Element::TimeValue { is_scans: generator.rng.one_in(2), dest, time }
        }
        0 | 1 => {
            let op = generator.pick(&[MathOp::Mod, MathOp::And, MathOp::Or, MathOp::Xor]);
            Element::Math { op, dest, op1: src, op2: random_operand(generator) }
        }
        2 | 3 => {
            use UnaryOp::{BcdToBin, BinToBcd, Neg, Not, Opposite, Swap};
            Element::Unary { op: generator.pick(&[Not, Neg, Swap, Opposite, BinToBcd, BcdToBin]), dest, src }
        }
        4 | 5 => {
            let op = generator.pick(&[ShiftOp::Shl, ShiftOp::Shr, ShiftOp::Sr0, ShiftOp::Rol, ShiftOp::Ror]);
            // Up to the bits that every operand has.
            let constant = constant_operand(generator.rng.below(9) as i64);
            let count = if generator.rng.one_in(2) { constant } else { LadderOperand::Var(random_integer(generator)) };
            Element::Shift { op, dest, src, count }
        }
        6 => Element::BitWrite { name: dest, bit: random_bit_number(generator), value: generator.rng.one_in(2) },
        _ => {
            let mut targets = [0, 1, 2, 3, 4, 5, 6, 7];
            targets.iter_mut().for_each(|to| {
                if generator.rng.one_in(2) {
                    *to = generator.rng.below(8) as u8;
                }
            });
            Element::Bus { dest, src, targets }
        }
    }
}

/// Elements on a bus that a program may have.
const MAX_TRANSFERS: u32 = 6;

/// SPI, SPI_WR, I2C_RD and I2C_WR; a transfer takes some time, so the bus is not slow.
fn random_bus_element(generator: &mut ProgramGenerator) -> Element {
    if generator.transfers >= MAX_TRANSFERS {
        return Element::Move { dest: random_integer(generator), src: random_operand(generator) };
    }
    generator.transfers += 1;
    let all = if generator.style.uses_i2c { [BusOp::I2cRead, BusOp::I2cWrite] } else { [BusOp::Spi, BusOp::SpiText] };
    let op = generator.pick(&all);
    let sends = matches!(op, BusOp::Spi | BusOp::I2cWrite);
    let receives = op == BusOp::I2cRead || op == BusOp::Spi && generator.rng.one_in(2);
    let register = match generator.rng.below(3) {
        0 => LadderOperand::Var(random_integer(generator)),
        _ => constant_operand(generator.rng.below(256) as i64),
    };
    Element::BusTransfer(Box::new(BusTransfer {
        op,
        name: "bus".to_owned(),
        send: sends.then(|| random_operand(generator)),
        text: if op == BusOp::SpiText { generator.pick(&["a", "Hi!", "~0"]).to_owned() } else { String::new() },
        recv: receives.then(|| random_integer(generator)),
        mode: "Master".to_owned(),
        device: constant_operand(if op.is_i2c() { generator.rng.below(128) as i64 } else { 0 }),
        register: if op.is_i2c() { register } else { constant_operand(8) },
        first: "MSB_FIRST".to_owned(),
        hertz: generator.pick(&[0, 100_000, 400_000]),
    }))
}

/// PULSER, NPULSE, STEPPER and QUAD_ENCOD: mostly short ones.
fn random_pulse_element(generator: &mut ProgramGenerator) -> Element {
    let few = |generator: &mut ProgramGenerator| match generator.rng.below(5) {
        0 => random_operand(generator),
        _ => constant_operand(generator.rng.below(5) as i64),
    };
    let [high, low, accel, count] = [(); 4].map(|()| few(generator));
    match generator.rng.below(5) {
        2 => Element::NpulseOff,
        3 => {
            let most = 500_000 / generator.style.cycle_us.max(1);
            let hertz = constant_operand((most / (1 + generator.rng.below(4))).max(1) as i64);
            Element::Npulse { count, hertz, coil: generator.pick(&generator.style.outputs.clone()) }
        }
        0 => Element::Pulser { high, low, accel, count, coil: generator.pick(&generator.style.outputs.clone()) },
        1 => {
            let (name, coil) =
                (generator.pick(&["p", "q"]).to_owned(), generator.pick(&generator.style.outputs.clone()));
            Element::Stepper { name, max: high, period: low, size: 0, graph: 0, coil }
        }
        _ => {
            let inputs = generator.style.inputs.clone();
            Element::QuadEncod {
                counter: random_integer(generator),
                interrupt: 0,
                inputs: [generator.pick(&inputs), generator.pick(&inputs)],
                zero: generator.rng.one_in(2).then(|| generator.pick(&inputs)),
                dir: generator.rng.one_in(2).then(|| generator.pick(&generator.style.outputs.clone())),
                zero_kind: generator.pick(&['/', '\\', '-', 'o']),
                turn: generator.pick(&[0, 1, 2, 7, 200]),
            }
        }
    }
}

/// A bit of an integer, or one just beyond its ends.
fn random_bit_number(generator: &mut ProgramGenerator) -> LadderOperand {
    match generator.rng.below(4) {
        0 => constant_operand(generator.pick(&[-1, 7, 8, 15, 16, 31, 32])),
        1 | 2 => constant_operand(generator.rng.below(16) as i64),
        _ => LadderOperand::Var(random_integer(generator)),
    }
}

fn random_contact(generator: &mut ProgramGenerator) -> Element {
    let from = match generator.rng.below(5) {
        0 | 1 => generator.style.inputs.clone(),
        2 => generator.style.outputs.clone(),
        _ => generator.style.relays.clone(),
    };
    Element::Contacts { name: generator.pick(&from), negated: generator.rng.one_in(2), set1: None }
}

fn random_coil(generator: &mut ProgramGenerator) -> Element {
    let from = if generator.rng.one_in(2) { generator.style.outputs.clone() } else { generator.style.relays.clone() };
    let latch = generator.rng.one_in(generator.style.coils_per_latch);
    let set = latch && generator.rng.one_in(2);
    let negated = !latch && generator.rng.one_in(4);
    let ttrigger = (generator.is_ldmicro5() && generator.rng.one_in(8)).then_some(1);
    Element::Coil { name: generator.pick(&from), negated, set, reset: latch && !set, ttrigger }
}

fn random_one_shot(generator: &mut ProgramGenerator) -> Element {
    let all = [Element::Osr, Element::Osf, Element::Odr, Element::Odf, Element::Osl, Element::Osc];
    // LDmicro 2.3 has the first two only.
    generator.pick(if generator.is_ldmicro5() { &all } else { &all[..2] })
}

/// The name of a timer or counter: any name, or on a machine with modules the next one without an element.
fn module_name(generator: &mut ProgramGenerator, names: &[String]) -> Option<String> {
    if !generator.is_module_machine() {
        return Some(generator.pick(names));
    }
    let name = names.iter().find(|name| !generator.modules.contains(name))?.clone();
    generator.modules.push(name.clone());
    Some(name)
}

fn random_timer(generator: &mut ProgramGenerator) -> Element {
    use TimerKind::{Rtl, Rto, Tcy, Thi, Tlo, Tof, Ton};
    let newer = generator.is_ldmicro5() && !generator.is_module_machine();
    let all = [Ton, Tof, Rto, Rtl, Tcy, Thi, Tlo];
    let kind = generator.pick(if newer { &all } else { &all[..3] });
    let Some(name) = module_name(generator, &generator.style.timers.clone()) else { return random_contact(generator) };
    // The preset is mostly 1 to 30 scans, which a check reaches; sometimes it is near 256 or the maximum.
    let scans = match generator.rng.below(12) {
        0 => 32_767,
        1 => 256 + generator.rng.below(3) as i64,
        2..5 => 1,
        _ => 1 + generator.rng.below(30) as i64,
    };
    if newer && generator.rng.one_in(6) {
        // A delay in a variable counts scans.
        return Element::Timer { kind, name, delay: LadderOperand::Var(random_integer(generator)), adjust: None };
    }
    let cycle = generator.style.cycle_us as i64;
    let part = if generator.rng.one_in(4) { generator.rng.below(cycle as u64) as i64 } else { 0 };
    let written = generator.is_ldmicro5() && generator.rng.one_in(3);
    let adjust = if written { generator.pick(&[-1, 0, 1]) } else { -i64::from(!generator.is_ldmicro5()) };
    let delay = constant_operand((scans - adjust) * cycle + part);
    Element::Timer { kind, name, delay, adjust: written.then(|| constant_operand(adjust)) }
}

fn random_counter(generator: &mut ProgramGenerator) -> Element {
    // AP101 has no circular counter with a carry.
    let kinds = match (generator.is_ldmicro5(), generator.is_module_machine()) {
        (true, true) => &[CounterKind::Ctu, CounterKind::Ctd][..],
        (true, false) => &[CounterKind::Ctu, CounterKind::Ctd, CounterKind::Ctc, CounterKind::Ctr],
        (false, _) => &[CounterKind::Ctu, CounterKind::Ctd, CounterKind::Ctc],
    };
    let kind = generator.pick(kinds);
    let Some(name) = module_name(generator, &generator.style.counters.clone()) else {
        return random_contact(generator);
    };
    let five = generator.is_ldmicro5();
    let small = generator.rng.below(8) as i64;
    let max = match generator.rng.below(3) {
        0 => generator.pick(BOUNDARIES).min(32_766),
        1 if five && !generator.is_module_machine() => return random_ldmicro5_counter(generator, kind, name),
        _ => small,
    };
    let input = if five && generator.rng.one_in(2) { Some(generator.pick(&['/', '\\', '-', 'o'])) } else { None };
    Element::Counter { kind, name, max: constant_operand(max), init: input.map(|_| constant_operand(0)), input }
}

/// A counter with features of LDmicro 5: a start value, and a limit that may be an integer symbol.
fn random_ldmicro5_counter(generator: &mut ProgramGenerator, kind: CounterKind, name: String) -> Element {
    let max = random_operand(generator);
    let init = if generator.rng.one_in(5) {
        LadderOperand::Var(random_integer(generator))
    } else {
        constant_operand(random_constant(generator))
    };
    let input = Some(generator.pick(&['/', '\\', '-', 'o']));
    Element::Counter { kind, name, max, init: Some(init), input }
}

fn random_reset(generator: &mut ProgramGenerator) -> Element {
    let mut names = generator.style.timers.clone();
    names.extend(generator.style.counters.iter().cloned());
    if !generator.is_module_machine() && generator.rng.one_in(4) {
        names.clone_from(&generator.style.integers);
    }
    Element::Res { name: generator.pick(&names) }
}

fn random_text(generator: &mut ProgramGenerator) -> Element {
    let text = generator.pick(TEXTS);
    let number = split_format_string(text, true)
        .is_ok_and(|all| all.iter().any(|piece| matches!(piece, StringPiece::Digit { .. })));
    let var = number.then(|| random_integer(generator));
    Element::FormattedString { var, text: text.to_owned(), quoted: generator.is_ldmicro5() }
}

fn random_table(generator: &mut ProgramGenerator) -> Element {
    let (dest, index) = (random_integer(generator), random_operand(generator));
    let count = if generator.rng.one_in(10) { 1 + generator.rng.below(40) } else { 1 + generator.rng.below(8) };
    let values = (0..count).map(|_| random_constant(generator)).collect();
    Element::LookUpTable { dest, index, as_string: false, values, name: None }
}

/// A PIECEWISE_LINEAR whose slopes can be computed in 16 bits.
fn random_curve(generator: &mut ProgramGenerator) -> Element {
    let (dest, index) = (random_integer(generator), random_operand(generator));
    let x = generator.pick(&[-100, 0, 10, -32_768, 32_700, 1_000]);
    let mut at = CurvePoint { x, y: generator.pick(&[0, 100, -5, 32_000, -32_768]) };
    let mut points = vec![at];
    for _ in 0..1 + generator.rng.below(4) {
        let dx =
            if generator.rng.one_in(5) { 1 + generator.rng.below(2_000) } else { 1 + generator.rng.below(40) } as i64;
        let steepest = 32_767 / dx;
        let dy = generator.pick(&[0, 1, -1, dx, -dx, 2 * dx, 7, -13, steepest, -steepest]).clamp(-steepest, steepest);
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
fn random_integer(generator: &mut ProgramGenerator) -> String {
    generator.pick(&generator.style.integers.clone())
}

/// A random integer symbol or constant.
fn random_operand(generator: &mut ProgramGenerator) -> LadderOperand {
    if generator.rng.one_in(generator.style.operands_per_constant) {
        constant_operand(random_constant(generator))
    } else {
        LadderOperand::Var(random_integer(generator))
    }
}

fn random_constant(generator: &mut ProgramGenerator) -> i64 {
    let five = generator.is_ldmicro5();
    let (low, high) = if five { (-(1 << 31), (1 << 31) - 1) } else { (-32_768, 32_767) };
    let value = match generator.rng.below(6) {
        0 => generator.rng.below(40) as i64 - 20,
        1 => i64::from(generator.rng.next_u64() as i16),
        2 if five => generator.pick(WIDE_BOUNDARIES),
        3 if !generator.constants.is_empty() => {
            generator.pick(&generator.constants.clone()) + generator.pick(&[-1, 0, 1])
        }
        _ => generator.pick(BOUNDARIES),
    };
    let value = value.clamp(low, high);
    generator.constants.push(value);
    value
}

/// A constant as an operand.
fn constant_operand(value: i64) -> LadderOperand {
    LadderOperand::Const { value, text: value.to_string() }
}
