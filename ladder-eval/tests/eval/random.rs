//! Runs random programs with random stimuli on the evaluator and the naive interpreter.
//!
//! Both must agree on every value after every scan and on the rung bit at every element. proptest prints the
//! smallest failing program and its seed.

use crate::common::model;
use crate::common::model::{constant, leaf, parallel, program, var};
use crate::naive;
use crate::random_adapt::{fit_transfers, name_pins, only_release_23};
use crate::random_flow::with_flow;
use crate::random_parts::{bus_element, pulse_element};
use std::collections::{BTreeSet, HashMap};

use ladder::{
    CompareOp, CounterKind, Element, ElementId, LadderDialect, LadderOperand, LadderProgram, LdFormat, MathOp,
    PowerEffect, ProgramElement, PwmChoice, RungNode, SerialTransfer, ShiftOp, TimerKind, UnaryOp, VarEntry,
    WriteMoment,
};
use ladder_eval::{BusEvent, Evaluator};
use proptest::prelude::*;
use proptest::sample::select;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

const BITS: &[&str] = &["Xa", "Xb", "Ya", "Ra", "Rb"];
pub(crate) const COILS: &[&str] = &["Ya", "Ra", "Rb"];
const INTEGERS: &[&str] = &["Ta", "Tb", "Ca", "n", "m", "s0", "s2", "Ain"];
/// Texts of strings without and with a number.
const TEXTS: &[&str] = &["", "a", "x\\r"];
const NUMBERS: &[&str] = &["\\1", "=\\3;", "\\-5", "a\\-2"];
/// Cycle in microseconds: writing one EEPROM cell takes three scans.
pub(crate) const CYCLE: i64 = 4_000;
/// Boundary values: 16-bit limits, zero, small presets and their neighbours, byte boundaries.
const VALUES: &[i64] = &[
    -32768, -32767, -257, -256, -255, -129, -128, -3, -2, -1, 0, 1, 2, 3, 4, 5, 127, 128, 181, 182, 255, 256, 257, 300,
    32766, 32767,
];

/// Registers that may be written.
const REGISTERS: &[&str] = &["#PORTB", "#TRISB", "#PORTC"];

pub(crate) fn integer() -> impl Strategy<Value = String> {
    select(INTEGERS).prop_map(str::to_owned)
}

pub(crate) fn operand() -> impl Strategy<Value = LadderOperand> {
    prop_oneof![
        select(INTEGERS).prop_map(var),
        select(VALUES).prop_map(constant),
        any::<i16>().prop_map(|v| constant(v.into()))
    ]
}

fn element() -> impl Strategy<Value = Element> {
    let contact = (select(BITS), any::<bool>()).prop_map(|(name, negated)| model::contacts(name, negated));
    let coil = (select(COILS), 0..5u8, 0..8u32).prop_map(|(name, kind, more)| Element::Coil {
        name: name.to_owned(),
        negated: kind == 1,
        set: kind == 2,
        reset: kind == 3,
        ttrigger: (kind == 4 || more == 0).then_some(1),
    });
    let plain = select(vec![
        Element::Short,
        Element::Open,
        Element::MasterRelay,
        Element::Osr,
        Element::Osf,
        Element::Odr,
        Element::Odf,
        Element::Osl,
        Element::Osc,
        Element::Comment("remark".to_owned()),
    ]);
    // Delays of 2 to 6 cycles, some of them not whole, and the two longest.
    let delay = prop_oneof![4 => 2 * CYCLE..7 * CYCLE, 1 => select(vec![32_767 * CYCLE, 32_769 * CYCLE - 1])];
    // LDmicro 5 accepts any delay: below one cycle, beyond the width, a variable.
    let delay = prop_oneof![
        8 => delay.prop_map(constant),
        1 => (0..2 * CYCLE).prop_map(constant),
        2 => select(INTEGERS).prop_map(var),
    ];
    use TimerKind::{Rtl, Rto, Tcy, Thi, Tlo, Tof, Ton};
    let adjust = prop::option::of((-3..3i64).prop_map(constant));
    let timer = (select(vec![Ton, Tof, Rto, Rtl, Tcy, Thi, Tlo]), integer(), delay, adjust)
        .prop_map(|(kind, name, delay, adjust)| Element::Timer { kind, name, delay, adjust });
    let limit = prop_oneof![
        6 => (0..4i64).prop_map(constant),
        6 => select(VALUES).prop_map(constant),
        1 => select(INTEGERS).prop_map(var),
    ];
    let start = prop_oneof![4 => select(VALUES).prop_map(constant), 1 => select(INTEGERS).prop_map(var)];
    let init = prop::option::of(start);
    let kinds = select(vec![CounterKind::Ctu, CounterKind::Ctd, CounterKind::Ctc, CounterKind::Ctr]);
    let input = prop::option::of(select(vec!['/', '\\', '-', 'o']));
    let counter = (kinds, integer(), limit, init, input).prop_map(|(kind, name, max, init, input)| Element::Counter {
        kind,
        name,
        max,
        init,
        input,
    });
    let res = integer().prop_map(|name| Element::Res { name });
    let mv = (integer(), operand()).prop_map(|(dest, src)| Element::Move { dest, src });
    let math = (select(vec![MathOp::Add, MathOp::Sub, MathOp::Mul, MathOp::Div]), integer(), operand(), operand())
        .prop_map(|(op, dest, op1, op2)| Element::Math { op, dest, op1, op2 });
    use CompareOp::{Equ, Geq, Grt, Leq, Les, Neq};
    let bits = bit_element();
    let compare = (select(vec![Equ, Neq, Grt, Geq, Les, Leq]), operand(), operand())
        .prop_map(|(op, op1, op2)| Element::Compare { op, op1, op2 });
    prop_oneof![
        6 => contact, 4 => coil, 4 => plain, 3 => timer, 3 => counter, 1 => res, 1 => mv, 3 => math, 2 => compare,
        8 => device(), 5 => bits, 2 => register_element(),
    ]
}

/// Elements that the random programs leave out.
const LEFT_OUT: &[(&str, &str)] = &[
    ("PLACEHOLDER", "passes power on like SHORT, and is an error of the check"),
    ("LOCK", "ends all scans; tests/ladder has traces"),
];

#[test]
fn every_element_is_generated() {
    let programs = (prop::collection::vec(prop::collection::vec(node(), 1..6), 1..5), any::<u64>());
    let mut runner = TestRunner::deterministic();
    let mut found = BTreeSet::new();
    for _ in 0..600 {
        let (rungs, flow) = programs.new_tree(&mut runner).expect("rungs").current();
        let program = in_dialect(with_flow(rungs, flow), true, false, Vec::new(), 2500);
        found.extend(program.elements().map(|ProgramElement { element, .. }| element.facts().keyword));
    }
    let missing: Vec<&str> = ladder::element_keywords().filter(|keyword| !found.contains(keyword)).collect();
    assert_eq!(missing, LEFT_OUT.iter().map(|row| row.0).collect::<Vec<_>>(), "missing, and left out with a reason");
}

/// Registers of ports as operands.
fn register_element() -> impl Strategy<Value = Element> {
    let source = prop_oneof![
        select(REGISTERS).prop_map(var),
        select(vec!["#PINB", "#PINC"]).prop_map(var),
        any::<u8>().prop_map(|byte| constant(byte.into())),
        select(INTEGERS).prop_map(var),
    ];
    let write =
        (select(REGISTERS), source.clone()).prop_map(|(dest, src)| Element::Move { dest: dest.to_owned(), src });
    let read = (integer(), source.clone()).prop_map(|(dest, src)| Element::Move { dest, src });
    let math = (select(REGISTERS), source.clone(), source).prop_map(|(dest, op1, op2)| Element::Math {
        op: MathOp::Add,
        dest: dest.to_owned(),
        op1,
        op2,
    });
    let bit = (select(REGISTERS), 0..9i64, any::<bool>()).prop_map(|(name, bit, value)| Element::BitWrite {
        name: name.to_owned(),
        bit: constant(bit),
        value,
    });
    prop_oneof![write, read, math, bit]
}

/// What LDmicro 5 does with the bits of integers.
fn bit_element() -> impl Strategy<Value = Element> {
    use MathOp::{And, Mod, Or, Xor};
    let math = (select(vec![Mod, And, Or, Xor]), integer(), operand(), operand())
        .prop_map(|(op, dest, op1, op2)| Element::Math { op, dest, op1, op2 });
    use UnaryOp::{BcdToBin, BinToBcd, Neg, Not, Opposite, Swap};
    let unary = (select(vec![Not, Neg, Swap, Opposite, BinToBcd, BcdToBin]), integer(), operand())
        .prop_map(|(op, dest, src)| Element::Unary { op, dest, src });
    use ShiftOp::{Rol, Ror, Shl, Shr, Sr0};
    let count = prop_oneof![select(INTEGERS).prop_map(var), (0..=8i64).prop_map(constant)];
    let shift = (select(vec![Shl, Shr, Sr0, Rol, Ror]), integer(), operand(), count)
        .prop_map(|(op, dest, src, count)| Element::Shift { op, dest, src, count });
    let place = prop_oneof![select(INTEGERS).prop_map(var), (-2..40i64).prop_map(constant)];
    let bit = (integer(), place, any::<bool>(), any::<bool>()).prop_map(|(name, bit, value, writes)| match writes {
        true => Element::BitWrite { name, bit, value },
        false => Element::BitTest { name, bit, value },
    });
    let order =
        prop_oneof![prop::array::uniform8(0..8u8), Just([0, 1, 2, 3, 4, 5, 6, 7]), Just([7, 6, 5, 4, 3, 2, 1, 0])];
    let bus = (integer(), operand(), order).prop_map(|(dest, src, targets)| Element::Bus { dest, src, targets });
    use ladder::SegmentDisplay::{Fourteen, Nine, Seven, Sixteen};
    let code = prop_oneof![operand(), (-2..180i64).prop_map(constant)];
    let segments = (select(vec![Seven, Nine, Fourteen, Sixteen]), integer(), code, select(vec!['C', 'A', 'x']))
        .prop_map(|(display, dest, src, common)| Element::Segments { display, dest, src, common });
    let time = prop_oneof![(0..9 * CYCLE).prop_map(constant), Just(constant(1_000_000_000_000))];
    let time =
        (any::<bool>(), integer(), time).prop_map(|(is_scans, dest, time)| Element::TimeValue { is_scans, dest, time });
    let random = integer().prop_map(|dest| Element::Random { dest });
    let seed = (integer(), operand()).prop_map(|(dest, src)| Element::SeedRandom { dest, src });
    let text = Element::Text { dest: None, var: Some("n".to_owned()), text: "n=\\5".to_owned(), quoted: true };
    let other = select(vec![Element::Sleep, Element::ClearWatchdog, Element::Delay { time: constant(5) }, text]);
    let new = prop_oneof![3 => segments, 1 => time, 2 => random, 1 => seed, 1 => other];
    prop_oneof![2 => math, 3 => unary, 3 => shift, 3 => bit, 1 => bus, 4 => new]
}

/// The tables and the elements that use a part of the chip.
fn device() -> impl Strategy<Value = Element> {
    let shift = (1..5u32).prop_map(|stages| Element::ShiftRegister { name: "s".to_owned(), stages });
    let index = prop_oneof![operand(), (0..5i64).prop_map(constant)];
    let look_up = (integer(), index, prop::collection::vec(select(VALUES), 0..5))
        .prop_map(|(dest, index, values)| Element::LookUpTable { dest, index, as_string: false, values, name: None });
    // Segments whose product fits 16 bits wherever they start.
    let segment = prop_oneof![(1..180i64, -180..180i64), (1..3i64, -10_000..10_000i64), (1..20_000i64, -1..2i64)];
    let start = (select(VALUES), select(VALUES));
    let curve =
        (integer(), operand(), start, prop::collection::vec(segment, 1..4)).prop_map(|(dest, index, start, steps)| {
            let mut points = vec![start];
            for (dx, dy) in steps {
                let (x, y) = points[points.len() - 1];
                // Points outside of 16 bits are left out.
                if x + dx <= 32_767 && (-32_768..32_768).contains(&(y + dy)) {
                    points.push((x + dx, y + dy));
                }
            }
            if points.len() < 2 {
                points = vec![(-3, 7), (3, -8)];
            }
            let points = points.into_iter().map(|(x, y)| ladder::CurvePoint { x, y }).collect();
            Element::PiecewiseLinear { dest, index, points, name: None }
        });
    let text = prop_oneof![
        select(TEXTS).prop_map(|text| (None, text)),
        (select(INTEGERS), select(NUMBERS)).prop_map(|(name, text)| (Some(name.to_owned()), text)),
    ];
    let text = text.prop_map(|(var, text)| Element::FormattedString { var, text: text.to_owned(), quoted: true });
    prop_oneof![
        2 => shift,
        2 => look_up,
        3 => curve,
        1 => Just(Element::ReadAdc { name: "Ain".to_owned(), refs: None }),
        1 => (operand(), select(vec!["Pa", "Pb"])).prop_map(|(duty, name)| {
            let output = Some(PwmChoice { name: name.to_owned(), resolution: String::new() });
            Element::SetPwm { duty, hertz: constant(1000), output }
        }),
        2 => (integer(), transfer(), 0..2u32).prop_map(|(name, rest, wait)| {
            Element::UartSend { name, rest: rest.map(|rest: SerialTransfer| SerialTransfer { wait, ..rest }) }
        }),
        3 => (integer(), transfer(), 0..3u32).prop_map(|(name, rest, wait)| {
            let rest = rest.map(|rest: SerialTransfer| SerialTransfer { wait: u32::from(wait == 0), ..rest });
            Element::UartRecv { name, rest }
        }),
        3 => text,
        2 => integer().prop_map(|name| Element::Persist { name }),
        1 => select(vec![Element::UartRecvAvail, Element::UartSendReady]),
        3 => pulse_element(),
        3 => bus_element(),
    ]
}

/// Numbers of bytes; [`in_dialect`] makes them fit the widths.
fn transfer() -> impl Strategy<Value = Option<SerialTransfer>> {
    prop::option::of((1..5u32).prop_map(|bytes| SerialTransfer { bytes, wait: 0 }))
}

/// What happened on a bus, as the naive interpreter notes it.
fn as_numbers(event: &BusEvent) -> (i64, i64, i64) {
    match *event {
        BusEvent::I2cWrite { device, register, byte } => (device.into(), register.into(), byte.into()),
        BusEvent::I2cRead { device, register } => (device.into(), register.into(), -1),
        BusEvent::Spi { byte } => (-1, -1, byte.into()),
    }
}

/// Creates a program of the dialect, with widths for some of its integers, and a rate of 1 to 4 scans per
/// byte.
fn in_dialect(rungs: Vec<Vec<RungNode>>, five: bool, old: bool, widths: Vec<u8>, baud: u64) -> LadderProgram {
    let mut program = program(rungs);
    program.settings.cycle_us = CYCLE as u64;
    program.settings.baud = Some(baud);
    if !five {
        program.rungs.iter_mut().for_each(|rung| only_release_23(&mut rung.series));
        return program;
    }
    program.dialect = LadderDialect::Ldmicro5;
    program.format = if old { LdFormat::V01 } else { LdFormat::V02 };
    // A timer needs a width that holds P, so timers get no declared width.
    let names = ["Ca", "n", "m", "s0", "s2", "Ain"];
    let entries = widths.into_iter().zip(names).map(|(bytes, name)| VarEntry {
        name: name.to_owned(),
        bytes,
        text: String::new(),
        pos: Default::default(),
    });
    program.vars = Some(entries.collect());
    let widths = program.symbols().into_iter().map(|symbol| (symbol.name, symbol.bytes.into())).collect();
    program.rungs.iter_mut().for_each(|rung| fit_transfers(&mut rung.series, &widths));
    program
}

fn maybe_with_flow(rungs: Vec<Vec<RungNode>>, seed: Option<u64>) -> Vec<Vec<RungNode>> {
    match seed {
        Some(seed) => with_flow(rungs, seed),
        None => rungs,
    }
}

fn node() -> impl Strategy<Value = RungNode> {
    element().prop_map(leaf).prop_recursive(3, 12, 4, |inner| {
        let series = prop::collection::vec(inner, 1..4);
        prop::collection::vec(series, 1..4).prop_map(parallel)
    })
}

/// Stimulus before a scan: both inputs and, optionally, an external write to an integer or a relay, an analog
/// level, a byte.
type RandomStimulus = (bool, bool, Option<(&'static str, i64)>, Option<(&'static str, bool)>, Option<u16>, Option<u8>);

fn stimulus() -> impl Strategy<Value = Vec<RandomStimulus>> {
    let write = prop::option::weighted(0.3, (select(INTEGERS), select(VALUES)));
    let force = prop::option::weighted(0.1, (select(COILS), any::<bool>()));
    let level = prop::option::weighted(0.3, prop_oneof![select(vec![0u16, 1, 511, 512, 1023]), 0..1024u16]);
    let byte = prop::option::weighted(0.4, any::<u8>());
    prop::collection::vec((any::<bool>(), any::<bool>(), write, force, level, byte), 1..40)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn agrees_with_the_naive_interpreter(
        rungs in prop::collection::vec(prop::collection::vec(node(), 0..6), 1..5),
        (five, old, flow) in any::<(bool, bool, Option<u64>)>(),
        widths in prop::collection::vec(1..=4u8, 0..7),
        baud in select(vec![2500u64, 1250, 1000, 700]),
        cells in prop::collection::vec(any::<u8>(), 0..6),
        chip in prop::option::of(any::<bool>()),
        stimulus in stimulus(),
    ) {
        let mut program = in_dialect(maybe_with_flow(rungs, flow), five, old, widths, baud);
        if let Some(avr) = chip {
            name_pins(&mut program, avr);
        }
        let mut eval = Evaluator::new(&program).map_err(|e| TestCaseError::fail(e.to_string()))?;
        let mut naive = naive::NaiveInterpreter::new(&program);
        for (addr, &byte) in cells.iter().enumerate() {
            naive.cells.insert(addr, byte);
            eval.set_eeprom(addr, byte);
        }
        let symbols = eval.symbols().to_vec();
        prop_assert_eq!(&symbols, &program.symbols());
        for (scan, (a, b, write, force, level, byte)) in stimulus.into_iter().enumerate() {
            let bits = [Some(("Xa", a)), Some(("Xb", b)), force];
            for (name, value) in bits.into_iter().flatten() {
                naive.bits.insert(name.to_owned(), value);
                if let Some(symbol) = eval.index(name) {
                    eval.set(symbol, value.into());
                }
            }
            if let Some((name, value)) = write {
                naive.store(name, value);
                if let Some(symbol) = eval.index(name) {
                    eval.set(symbol, value as i32);
                }
            }
            if let Some(level) = level {
                naive.levels.insert("Ain".to_owned(), level.into());
                eval.index("Ain").iter().for_each(|&symbol| eval.set_adc(symbol, level));
            }
            if let Some(byte) = byte {
                let free = naive.received_byte.is_none();
                naive.received_byte.get_or_insert(byte);
                prop_assert_eq!(eval.receive(byte), free);
            }
            // A snapshot that scans without a watcher must end in the same state as the watched original.
            let answer = (scan * 77 % 256) as u8;
            naive.answer = answer.into();
            eval.set_bus_answer(answer);
            let mut unwatched = eval.clone();
            unwatched.scan();
            let mut seen = Vec::new();
            eval.scan_watched(&mut |element, before, after| seen.push((element, before, after)));
            prop_assert_eq!(seen, naive.scan(&program), "scan {}\n{}", scan + 1, ladder::write(&program));
            prop_assert_eq!(eval.scans(), scan as u64 + 1);
            prop_assert_eq!(eval.sent_bytes(), &naive.sent[..], "scan {}", scan + 1);
            let on_buses: Vec<(i64, i64, i64)> = eval.bus_events().iter().map(as_numbers).collect();
            prop_assert_eq!(&on_buses, &naive.on_buses, "scan {}", scan + 1);
            prop_assert_eq!(eval.has_received_byte(), naive.received_byte.is_some());
            for (output, duty) in eval.pwm_outputs().iter().zip(eval.pwm_duties()) {
                prop_assert_eq!(duty.map(i64::from), naive.duties.get(&output.name).copied());
            }
            let cells: Vec<u8> = (0..eval.eeprom().len()).map(|a| naive.cells.get(&a).copied().unwrap_or(255)).collect();
            prop_assert_eq!(eval.eeprom(), cells, "scan {}", scan + 1);
            for (i, symbol) in symbols.iter().enumerate() {
                let wanted = if symbol.kind.is_bit() { i64::from(naive.bit(&symbol.name)) } else { naive.integer(&symbol.name) };
                prop_assert_eq!(i64::from(eval.get(i)), wanted, "scan {}, {}", scan + 1, &symbol.name);
                prop_assert_eq!(unwatched.get(i), eval.get(i), "unwatched, scan {}, {}", scan + 1, &symbol.name);
            }
        }
    }

    /// The evaluator behaves as the table of elements states for power, writes and memory.
    #[test]
    fn elements_do_what_their_rows_say(
        rungs in prop::collection::vec(prop::collection::vec(node(), 0..6), 1..5),
        (five, old, flow) in any::<(bool, bool, Option<u64>)>(),
        cells in prop::collection::vec(any::<u8>(), 0..6),
        stimulus in stimulus(),
    ) {
        let program = in_dialect(maybe_with_flow(rungs, flow), five, old, Vec::new(), 2500);
        let mut eval = Evaluator::new(&program).map_err(|e| TestCaseError::fail(e.to_string()))?;
        cells.iter().enumerate().for_each(|(addr, &byte)| eval.set_eeprom(addr, byte));
        let elements: HashMap<ElementId, &Element> = program.elements().map(|ProgramElement { id, element, .. }| (id, element)).collect();
        for (a, b, write, ..) in stimulus {
            for (name, value) in [("Xa", a.into()), ("Xb", b.into())].into_iter().chain(write) {
                eval.index(name).iter().for_each(|&symbol| eval.set(symbol, value as i32));
            }
            let mut steps = Vec::new();
            let mut values: Vec<i32> = (0..eval.symbols().len()).map(|symbol| eval.get(symbol)).collect();
            eval.clone().scan_traced(|id, before, after, now| steps.push((id, before, after, now.to_vec())));
            eval.scan();
            for (id, before, after, now) in steps {
                let element = elements[&id];
                let facts = element.facts();
                let fits = match facts.power {
                    PowerEffect::NoWire => false,
                    PowerEffect::Wire | PowerEffect::Acts => before == after,
                    PowerEffect::Narrows => before || !after,
                    PowerEffect::Decides => true,
                };
                prop_assert!(fits, "{element:?}: {before} {after}");
                for (symbol, (old, new)) in eval.symbols().iter().zip(values.iter().zip(&now)) {
                    let may = facts.write_moment(&symbol.name).is_some_and(|moment| match moment {
                        WriteMoment::Always => true,
                        WriteMoment::Powered => before,
                        WriteMoment::Passing => after,
                    });
                    // The levels of pins are taken at the start of the scan.
                    let may = may || symbol.name.starts_with("#PIN");
                    prop_assert!(old == new || may, "{element:?} writes {}: {old} {new}", symbol.name);
                }
                values = now;
            }
        }
    }

    /// The effect of an element depends only on the symbols that its row lists as read.
    #[test]
    fn elements_read_what_their_rows_say(
        element in element(),
        settings in prop::collection::vec((any::<bool>(), select(INTEGERS), select(VALUES)), 1..8),
        other in select(VALUES),
    ) {
        let program = in_dialect(vec![vec![leaf(model::contacts("Xa", false)), leaf(element.clone())]], true, false, Vec::new(), 2500);
        let mut eval = Evaluator::new(&program).map_err(|e| TestCaseError::fail(e.to_string()))?;
        let facts = element.facts();
        for (power, name, value) in settings {
            for (name, value) in [("Xa", power.into()), (name, value)] {
                eval.index(name).iter().for_each(|&symbol| eval.set(symbol, value as i32));
            }
            let seen = |mut eval: Evaluator, but: usize| {
                let mut out = None;
                eval.scan_watched(&mut |_, _, after| out = Some(after));
                let values: Vec<i32> = (0..eval.symbols().len()).filter(|n| *n != but).map(|n| eval.get(n)).collect();
                (out, values, (eval.sent_bytes().to_vec(), eval.bus_events().to_vec()), eval.pwm_duties().to_vec(), eval.eeprom().to_vec())
            };
            for (symbol, named) in eval.symbols().iter().enumerate() {
                if named.name == "Xa" || facts.symbols.iter().any(|used| used.is_read && used.name == named.name) {
                    continue;
                }
                let mut changed = eval.clone();
                changed.set(symbol, other as i32);
                prop_assert_eq!(seen(eval.clone(), symbol), seen(changed, symbol), "{:?} reads {}", element, named.name);
            }
            eval.scan();
        }
    }
}
