//! Property tests: random programs survive a round trip; random and damaged text never panics.
//!
//! proptest prints the failing case and its seed.

use crate::common;
use diag::Pos;
use ladder::{
    BusOp, BusTransfer, CompareOp, CounterKind, Element, FlowOp, IoEntry, LadderDialect, LadderOperand, LadderProgram,
    LdFormat, MathOp, ProgramSettings, PwmChoice, Rung, RungNode, SegmentDisplay, SerialTransfer, ShiftOp, SourceStyle,
    TimerKind, UnaryOp, VarEntry,
};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use std::collections::BTreeSet;

fn integer() -> impl Strategy<Value = String> {
    "[ACTa-z][A-Za-z0-9_]{0,8}"
}

fn operand() -> impl Strategy<Value = LadderOperand> {
    let number = |value: i64, text: String| LadderOperand::Const { value, text };
    prop_oneof![
        integer().prop_map(LadderOperand::Var),
        (-32768i64..=32767).prop_map(move |v| number(v, v.to_string())),
        (0i64..=32767).prop_map(move |v| number(v, format!("0x{v:X}"))),
        "[ -~&&[^\\\\]]".prop_map(move |c| number(c.bytes().map(i64::from).sum(), format!("'{c}'"))),
    ]
}

fn delay() -> impl Strategy<Value = LadderOperand> {
    (0i64..=1_000_000_000_000).prop_map(|value| LadderOperand::Const { value, text: value.to_string() })
}

fn boxed(strategy: impl Strategy<Value = Element> + 'static) -> BoxedStrategy<Element> {
    strategy.boxed()
}

fn element() -> impl Strategy<Value = Element> {
    let flag = option::of(0u32..=1);
    use CounterKind::{Ctc, Ctd, Ctr, Ctu};
    use TimerKind::{Rtl, Rto, Tcy, Thi, Tlo, Tof, Ton};
    let timer = proptest::sample::select(vec![Ton, Tof, Rto, Rtl, Tcy, Thi, Tlo]);
    let counter = proptest::sample::select(vec![Ctu, Ctd, Ctc, Ctr]);
    let math = proptest::sample::select(vec![
        MathOp::Add,
        MathOp::Sub,
        MathOp::Mul,
        MathOp::Div,
        MathOp::Mod,
        MathOp::And,
        MathOp::Or,
        MathOp::Xor,
    ]);
    let unary = proptest::sample::select(vec![
        UnaryOp::Not,
        UnaryOp::Neg,
        UnaryOp::Swap,
        UnaryOp::Opposite,
        UnaryOp::BinToBcd,
        UnaryOp::BcdToBin,
    ]);
    let shift = proptest::sample::select(vec![ShiftOp::Shl, ShiftOp::Shr, ShiftOp::Sr0, ShiftOp::Rol, ShiftOp::Ror]);
    let compare = proptest::sample::select(vec![
        CompareOp::Equ,
        CompareOp::Neq,
        CompareOp::Grt,
        CompareOp::Geq,
        CompareOp::Les,
        CompareOp::Leq,
    ]);
    let more = option::of((operand(), option::of(proptest::sample::select(vec!['/', '\\', '-', 'o']))));
    let plain = proptest::sample::select(vec![
        Element::Short,
        Element::Open,
        Element::Placeholder,
        Element::MasterRelay,
        Element::Osr,
        Element::Osf,
        Element::Odr,
        Element::Odf,
        Element::Osl,
        Element::Osc,
        Element::UartRecvAvail,
        Element::UartSendReady,
        Element::NpulseOff,
    ]);
    let value = -32768i64..=32767;
    let uart = option::of((1u32..=255, 0u32..=1).prop_map(|(bytes, wait)| SerialTransfer { bytes, wait }));
    let contact = ("[XYR][A-Za-z0-9_]{0,8}", any::<bool>(), flag.clone());
    let coil = ("[YR][A-Za-z0-9_]{0,8}", any::<bool>(), any::<bool>(), any::<bool>(), flag);
    let string = prop_oneof![
        (option::of(integer()), "[\\x00-\\xFF]{0,12}", Just(false)),
        (option::of(integer()), "[ -~é]{0,12}", Just(true)),
    ];
    proptest::strategy::Union::new(vec![
        boxed("(\\PC|[\n\r\\\\]){0,20}".prop_map(|t| Element::Comment(t.trim().to_owned()))),
        boxed(contact.prop_map(|(name, negated, set1)| Element::Contacts { name, negated, set1 })),
        boxed(coil.prop_map(|(name, negated, set, reset, ttrigger)| Element::Coil {
            name,
            negated,
            set,
            reset,
            ttrigger,
        })),
        boxed(plain),
        boxed(
            (timer, integer(), delay(), option::of(operand())).prop_map(|(kind, name, delay, adjust)| Element::Timer {
                kind,
                name,
                delay,
                adjust,
            }),
        ),
        boxed((counter, integer(), operand(), more).prop_map(|(kind, name, max, more)| {
            let (init, input) = more.map_or((None, None), |(i, k)| (Some(i), k));
            Element::Counter { kind, name, max, init, input }
        })),
        boxed(integer().prop_map(|name| Element::Res { name })),
        boxed((integer(), operand()).prop_map(|(dest, src)| Element::Move { dest, src })),
        boxed((math, integer(), operand(), operand()).prop_map(|(op, dest, op1, op2)| Element::Math {
            op,
            dest,
            op1,
            op2,
        })),
        boxed((unary, integer(), operand()).prop_map(|(op, dest, src)| Element::Unary { op, dest, src })),
        boxed((shift, integer(), operand(), operand()).prop_map(|(op, dest, src, count)| Element::Shift {
            op,
            dest,
            src,
            count,
        })),
        boxed((integer(), operand(), any::<bool>()).prop_map(|(name, bit, value)| Element::BitWrite {
            name,
            bit,
            value,
        })),
        boxed((integer(), operand(), any::<bool>()).prop_map(|(name, bit, value)| Element::BitTest {
            name,
            bit,
            value,
        })),
        boxed(
            (integer(), operand(), proptest::array::uniform8(0u8..8)).prop_map(|(dest, src, targets)| Element::Bus {
                dest,
                src,
                targets,
            }),
        ),
        boxed(flow_element()),
        boxed((compare, operand(), operand()).prop_map(|(op, op1, op2)| Element::Compare { op, op1, op2 })),
        boxed((integer(), 1u32..=256).prop_map(|(name, stages)| Element::ShiftRegister { name, stages })),
        boxed((integer(), operand(), any::<bool>(), vec(value.clone(), 0..6), option::of(integer())).prop_map(
            |(dest, index, as_string, values, name)| Element::LookUpTable { dest, index, as_string, values, name },
        )),
        boxed(
            (
                integer(),
                operand(),
                vec((value.clone(), value).prop_map(|(x, y)| ladder::CurvePoint { x, y }), 0..6),
                option::of(integer()),
            )
                .prop_map(|(dest, index, points, name)| Element::PiecewiseLinear {
                    dest,
                    index,
                    points,
                    name,
                }),
        ),
        boxed(("A[a-z0-9]{0,5}", option::of(0u32..=255)).prop_map(|(name, refs)| Element::ReadAdc { name, refs })),
        boxed((operand(), 1i64..=100_000_000, option::of(("P[a-z]{0,4}", "[0-9]-[0-9]"))).prop_map(
            |(duty, hertz, output)| {
                let hertz = LadderOperand::Const { value: hertz, text: hertz.to_string() };
                let output = output.map(|(name, resolution)| PwmChoice { name, resolution });
                Element::SetPwm { duty, hertz, output }
            },
        )),
        boxed((integer(), uart.clone()).prop_map(|(name, rest)| Element::UartRecv { name, rest })),
        boxed((integer(), uart).prop_map(|(name, rest)| Element::UartSend { name, rest })),
        boxed(integer().prop_map(|name| Element::Persist { name })),
        pulse_element(),
        bus_element(),
        boxed(string.clone().prop_map(|(var, text, quoted)| Element::FormattedString { var, text, quoted })),
        boxed((option::of("[a-z]{1,4}"), string).prop_map(|(dest, (var, text, quoted))| Element::Text {
            dest,
            var,
            text,
            quoted,
        })),
    ])
}

#[test]
fn every_element_is_generated() {
    let (elements, mut runner) = (element(), TestRunner::deterministic());
    let mut next = || elements.new_tree(&mut runner).expect("an element").current().facts().keyword;
    let found: BTreeSet<&str> = (0..10_000).map(|_| next()).collect();
    let missing: Vec<&str> = ladder::element_keywords().filter(|keyword| !found.contains(keyword)).collect();
    assert!(missing.is_empty(), "element() never gives {}", missing.join(", "));
}

proptest! {
    /// The constants of the operands are those of the element's row, which has the ones of tables too.
    #[test]
    fn operands_have_the_constants_of_the_row(mut element in element()) {
        let constants = element.facts().constants;
        let is_table = matches!(element, Element::LookUpTable { .. } | Element::PiecewiseLinear { .. });
        let value = |operand: &mut LadderOperand| match operand {
            LadderOperand::Const { value, .. } => Some(*value),
            LadderOperand::Var(_) => None,
        };
        let found: Vec<i64> = element.operands_mut().into_iter().filter_map(value).collect();
        prop_assert!(found == constants || is_table && constants.starts_with(&found), "{found:?} {constants:?}");
    }
}

/// SPI, SPI_WR, I2C_RD and I2C_WR.
fn bus_element() -> BoxedStrategy<Element> {
    let op = proptest::sample::select(vec![BusOp::Spi, BusOp::SpiText, BusOp::I2cRead, BusOp::I2cWrite]);
    let number = |value: i64| LadderOperand::Const { value, text: value.to_string() };
    let words = ("[A-Za-z][a-z0-9]{0,5}", "[A-Za-z0-9]{1,8}", "Master|Slave", "MSB_FIRST|LSB_FIRST");
    let receiver = option::of(integer());
    (op, words, operand(), receiver, (0i64..128, 0i64..256, 0i64..4), 0u32..=100_000_000)
        .prop_map(move |(op, (name, text, mode, first), send, recv, (device, register, clock), hertz)| {
            let sends = matches!(op, BusOp::Spi | BusOp::I2cWrite);
            let receives = matches!(op, BusOp::Spi | BusOp::I2cRead);
            Element::BusTransfer(Box::new(BusTransfer {
                op,
                name,
                send: sends.then_some(send),
                text: if op == BusOp::SpiText { text } else { String::new() },
                recv: recv.filter(|_| receives),
                mode,
                device: number(if op.is_i2c() { device } else { clock }),
                register: number(register),
                first,
                hertz,
            }))
        })
        .boxed()
}

/// PULSER, NPULSE, STEPPER and QUAD_ENCOD.
fn pulse_element() -> BoxedStrategy<Element> {
    let (coil, input) = (|| "[YR][A-Za-z0-9_]{0,8}", || "X[A-Za-z0-9_]{0,8}");
    let pulser = (operand(), operand(), operand(), operand(), coil())
        .prop_map(|(high, low, accel, count, coil)| Element::Pulser { high, low, accel, count, coil });
    let npulse = (operand(), 1i64..=100_000_000, coil()).prop_map(|(count, hertz, coil)| {
        let hertz = LadderOperand::Const { value: hertz, text: hertz.to_string() };
        Element::Npulse { count, hertz, coil }
    });
    let stepper = (integer(), operand(), operand(), 0u32..=1024, 0u32..=255, "Y[A-Za-z0-9_]{0,8}")
        .prop_map(|(name, max, period, size, graph, coil)| Element::Stepper { name, max, period, size, graph, coil });
    let kind = proptest::sample::select(vec!['/', '\\', '-', 'o']);
    let names = (input(), input(), option::of(input()), option::of(coil()));
    let encoder = (integer(), 0u32..=255, names, kind, 0u32..=32_767).prop_map(
        |(counter, interrupt, (a, b, zero, dir), zero_kind, turn)| Element::QuadEncod {
            counter,
            interrupt,
            inputs: [a, b],
            zero,
            dir,
            zero_kind,
            turn,
        },
    );
    prop_oneof![pulser, npulse, stepper, encoder].boxed()
}

fn node() -> impl Strategy<Value = RungNode> {
    element().prop_map(|e| RungNode::Leaf(e, Pos::default())).prop_recursive(4, 24, 4, |inner| {
        vec(vec(inner, 1..4), 1..4).prop_map(|branches| RungNode::Parallel(branches, Pos::default()))
    })
}

fn program() -> impl Strategy<Value = LadderProgram> {
    let settings = (
        option::of("[A-Za-z0-9]([A-Za-z0-9 -]{0,20}[A-Za-z0-9])?"),
        0u64..1_000_000,
        1u64..20_000_000,
        option::of(0u64..9999),
    );
    let header = option::of(proptest::sample::select(vec!["", "0.3", "5.4"]).prop_map(str::to_owned));
    let style =
        (header, any::<bool>()).prop_map(|(header, rung_numbers)| SourceStyle { header, rung_numbers, crlf: false });
    let io = vec((0u8..3, option::of((0u32..=255, 0u32..=65535))), 0..5);
    (any::<bool>(), settings, io, option::of(vec(1u8..=4, 0..3)), (style, vec(vec(node(), 1..5), 1..5))).prop_map(
        |(new, (micro, cycle_us, crystal_hz, baud), io, vars, (style, rungs))| {
            let has_micro = micro.is_some();
            LadderProgram {
                declarations: Vec::new(),
                file: "t".to_owned(),
                format: if new { LdFormat::V02 } else { LdFormat::V01 },
                dialect: if new { LadderDialect::Ldmicro5 } else { LadderDialect::Ldmicro23 },
                style: if new { style } else { SourceStyle::default() },
                settings: ProgramSettings {
                    micro,
                    cycle_us,
                    cycle_rest: if new { "us at Timer1".to_owned() } else { String::new() },
                    crystal_hz,
                    crystal_rest: String::new(),
                    baud,
                    baud_rest: String::new(),
                    compiler: new.then(|| "any".to_owned()),
                    compiled: None,
                },
                io: (1..)
                    .zip(io)
                    .map(|(pin, (letter, modbus))| {
                        let letter = ["X", "Y", "A"][usize::from(letter)];
                        IoEntry { name: format!("{letter}{pin}"), pin, modbus, pos: Pos::default() }
                    })
                    .collect(),
                vars: vars.map(|widths| {
                    let entry = |(n, bytes): (usize, u8)| {
                        let name = format!("v{n}");
                        VarEntry { text: format!("{bytes} bytes {name}"), name, bytes, pos: Pos::default() }
                    };
                    widths.into_iter().enumerate().map(entry).collect()
                }),
                pull_ups: (new && has_micro).then(|| vec!["Pb: 0x0F".to_owned()]),
                rungs: rungs.into_iter().map(|series| Rung { series, pos: Pos::default() }).collect(),
            }
        },
    )
}

/// Returns the program with all positions cleared.
fn bare(mut program: LadderProgram) -> LadderProgram {
    fn series(nodes: &mut [RungNode]) {
        for node in nodes {
            match node {
                RungNode::Leaf(_, pos) => *pos = Pos::default(),
                RungNode::Parallel(branches, pos) => {
                    *pos = Pos::default();
                    branches.iter_mut().for_each(|b| series(b));
                }
            }
        }
    }
    program.io.iter_mut().for_each(|e| e.pos = Pos::default());
    program.vars.iter_mut().flatten().for_each(|e| e.pos = Pos::default());
    for rung in &mut program.rungs {
        rung.pos = Pos::default();
        series(&mut rung.series);
    }
    program
}

/// Calls everything that takes a program, to find panics, and checks the guarantees of the drawing.
fn use_it(program: &LadderProgram) {
    let _ = ladder::check(program);
    let _ = program.symbols();
    let drawing = ladder::draw(program);
    assert!(drawing.ends_with("||\n"), "{drawing}");
    for (index, rung) in program.rungs.iter().enumerate() {
        let drawing = ladder::draw_rung(program, index);
        let width = drawing.lines.first().map(|l| l.chars().count());
        assert!(drawing.lines.iter().all(|l| Some(l.chars().count()) == width), "{drawing:#?}");
        assert_eq!(rung.series.is_empty(), drawing.elements.is_empty());
    }
}

proptest! {
    #[test]
    fn a_program_goes_round(program in program()) {
        let text = ladder::write(&program);
        let parsed = ladder::parse("t", &text).map_err(|e| TestCaseError::fail(format!("{e:?}\n{text}")))?;
        // Under the old header the dialect follows what the program has.
        let newer = program.only_ldmicro5_writes();
        let notes: Vec<&str> = parsed.warnings.iter().map(|note| note.code).filter(|code| *code != "LD004").collect();
        let taken = newer && program.dialect == LadderDialect::Ldmicro23;
        prop_assert_eq!(notes, if taken { vec!["LD038"] } else { vec![] }, "{}", text);
        use_it(&parsed.program);
        let wanted = if taken { LadderProgram { dialect: LadderDialect::Ldmicro5, ..program } } else { program };
        prop_assert_eq!(bare(parsed.program), wanted);
    }

    #[test]
    fn damaged_text_never_panics(program in program(), cuts in vec((any::<prop::sample::Index>(), 0usize..5, "\\PC{0,3}"), 1..6)) {
        let mut text: Vec<char> = ladder::write(&program).chars().collect();
        for (at, count, new) in cuts {
            let at = at.index(text.len() + 1);
            let end = (at + count).min(text.len());
            text.splice(at..end, new.chars());
        }
        let text: String = text.into_iter().collect();
        if let Ok(parsed) = ladder::parse("t", &text) {
            use_it(&parsed.program);
        }
    }

    #[test]
    fn shuffled_lines_never_panic(program in program(), order in vec(any::<prop::sample::Index>(), 0..40)) {
        let text = ladder::write(&program);
        let lines: Vec<&str> = text.lines().collect();
        let text: Vec<&str> = order.iter().map(|i| lines[i.index(lines.len())]).collect();
        if let Ok(parsed) = ladder::parse("t", &format!("{}{}", common::HEAD, text.join("\n"))) {
            use_it(&parsed.program);
        }
    }

    #[test]
    fn random_bytes_never_panic(bytes in vec(any::<u8>(), 0..200)) {
        let _ = ladder::parse_bytes("t", &bytes, ladder::ParseOptions::default());
        let text = format!("{}RUNG\n{}", common::HEAD, String::from_utf8_lossy(&bytes).replace(char::is_control, "\n"));
        let _ = ladder::parse("t", &text);
    }
}

/// What names a place of the program, whether or not there is one, and other elements of LDmicro 5.
fn flow_element() -> impl Strategy<Value = Element> {
    use FlowOp::{EndSubprogram, Gosub, Goto, Label, Subprogram};
    let named =
        (proptest::sample::select(vec![Label, Goto, Gosub, Subprogram, EndSubprogram]), "[A-Za-z_][A-Za-z0-9_]{0,8}");
    use SegmentDisplay::{Fourteen, Nine, Seven, Sixteen};
    let display = proptest::sample::select(vec![Seven, Nine, Fourteen, Sixteen]);
    prop_oneof![
        4 => named.prop_map(|(op, label)| Element::Flow { op, label }),
        1 => (1..1000u32).prop_map(|rung| Element::Flow { op: Goto, label: rung.to_string() }),
        4 => proptest::sample::select(vec![Element::Return, Element::Sleep, Element::ClearWatchdog, Element::Lock]),
        1 => integer().prop_map(|dest| Element::Random { dest }),
        1 => (integer(), operand()).prop_map(|(dest, src)| Element::SeedRandom { dest, src }),
        1 => operand().prop_map(|time| Element::Delay { time }),
        2 => (any::<bool>(), integer(), delay()).prop_map(|(is_scans, dest, time)| Element::TimeValue {
            is_scans,
            dest,
            time,
        }),
        2 => (display, integer(), operand(), "[A-Za-z]").prop_map(|(display, dest, src, letter)| Element::Segments {
            display,
            dest,
            src,
            common: letter.chars().next().unwrap_or('C'),
        }),
    ]
}
