//! Tests the public interface of the evaluator: symbols, external values, watch callbacks and refusals.

use crate::common::model::{coil, constant, contacts, leaf, parallel, program, var};
use ladder::{
    CompareOp, CounterKind, Element, ElementId, LadderDialect, MathOp, PwmChoice, RungNode, SerialTransfer, TimerKind,
};
use ladder_eval::{Evaluator, UnsupportedElement};

fn move_constant(dest: &str, value: i64) -> Element {
    Element::Move { dest: dest.to_owned(), src: constant(value) }
}

fn timer(name: &str, delay: i64) -> Element {
    Element::Timer { kind: TimerKind::Ton, name: name.to_owned(), delay: constant(delay), adjust: None }
}

fn counter(name: &str, max: i64) -> Element {
    Element::Counter { kind: CounterKind::Ctu, name: name.to_owned(), max: constant(max), init: None, input: None }
}

fn transfer(bytes: u32, wait: u32) -> Option<SerialTransfer> {
    Some(SerialTransfer { bytes, wait })
}

#[test]
fn symbols_are_those_of_the_model_and_values_are_cut_to_their_kind() {
    let program = program(vec![vec![leaf(contacts("Xa", false)), leaf(move_constant("n", 5)), leaf(coil("Yq"))]]);
    let mut eval = Evaluator::new(&program).expect("simple elements");
    assert_eq!(eval.symbols(), program.symbols());
    for (i, symbol) in program.symbols().iter().enumerate() {
        assert_eq!(eval.index(&symbol.name), Some(i));
        assert_eq!(eval.get(i), 0, "{} at power-up", symbol.name);
    }
    assert_eq!(eval.index("nobody"), None);
    let x = eval.index("Xa").expect("Xa");
    let n = eval.index("n").expect("n");
    #[rustfmt::skip]
    let cases = [
        // Symbol, value set, value stored.
        (x,      0,      0), (x,      1,      1), (x,     -1,      1), (x, 0x10000,      1),
        (n,  32767,  32767), (n,  32768, -32768), (n, -32768, -32768), (n,  -32769,  32767),
        (n, 0x12345, 0x2345), (n, i32::MIN,    0), (n, i32::MAX,    -1),
    ];
    for (symbol, given, held) in cases {
        eval.set(symbol, given);
        assert_eq!(eval.get(symbol), held, "{given}");
    }
    let past = program.symbols().len();
    eval.set(past, 1);
    assert_eq!(eval.get(past), 0);
    assert_eq!(eval.scans(), 0);
    let mut copy = eval.clone();
    copy.set(x, 1);
    copy.scan();
    assert_eq!((copy.scans(), copy.get(n)), (1, 5));
    assert_eq!((eval.scans(), eval.get(n)), (0, -1), "a clone is a snapshot");
}

#[test]
fn a_watcher_gets_every_element_but_comments_in_text_order() {
    let comment = || leaf(Element::Comment("remark".to_owned()));
    let program = program(vec![
        vec![comment()],
        vec![
            comment(),
            leaf(contacts("Xa", false)),
            parallel(vec![
                vec![leaf(contacts("Xb", true)), leaf(Element::Osr)],
                vec![parallel(vec![vec![leaf(Element::Open)], vec![leaf(Element::Short)]])],
            ]),
            leaf(coil("Yq")),
        ],
        vec![],
        vec![leaf(Element::MasterRelay)],
    ]);
    let mut eval = Evaluator::new(&program).expect("simple elements");
    let mut watched = Vec::new();
    for xa in [0, 1] {
        eval.set(eval.index("Xa").expect("Xa"), xa);
        eval.scan_watched(&mut |ElementId { rung, index }, before, after| watched.push((rung, index, before, after)));
    }
    #[rustfmt::skip]
    let wanted = [
        (1, 1, true, false), (1, 2, false, false), (1, 3, false, false), (1, 4, false, false), (1, 5, false, false),
        (1, 6, false, false), (3, 0, true, true),
        (1, 1, true, true),  (1, 2, true, true),   (1, 3, true, true),   (1, 4, true, false),  (1, 5, true, true),
        (1, 6, true, true),  (3, 0, true, true),
    ];
    assert_eq!(watched, wanted);
}

/// Refusal of a program that has `element` as the third element of its second rung.
fn refusal(change: impl Fn(&mut ladder::LadderProgram), element: Element) -> Result<(), UnsupportedElement> {
    let before = vec![leaf(Element::Comment("remark".to_owned())), parallel(vec![vec![leaf(Element::Short)]])];
    let rungs: Vec<Vec<RungNode>> = vec![vec![leaf(contacts("Ra", false))], [before, vec![leaf(element)]].concat()];
    let mut program = program(rungs);
    change(&mut program);
    Evaluator::new(&program).map(|_| ())
}

#[test]
fn what_has_no_meaning_is_refused_by_name_and_place() {
    let name = || "n".to_owned();
    let with = |adjust: i64| Element::Timer {
        kind: TimerKind::Rto,
        name: "Tt".to_owned(),
        delay: constant(50_000),
        adjust: Some(constant(adjust)),
    };
    let count = |init: Option<i64>, input| Element::Counter {
        kind: CounterKind::Ctc,
        name: "Cn".to_owned(),
        max: constant(3),
        init: init.map(constant),
        input,
    };
    let max5 = Element::Counter { kind: CounterKind::Ctu, name: name(), max: var("m"), init: None, input: None };
    let curve = |points: &[(i64, i64)]| Element::PiecewiseLinear {
        dest: name(),
        index: var("m"),
        points: points.iter().map(|&(x, y)| ladder::CurvePoint { x, y }).collect(),
        name: None,
    };
    let pwm = |hertz, resolution: Option<&str>| {
        let output = resolution.map(|r| PwmChoice { name: "Pout".to_owned(), resolution: r.to_owned() });
        Element::SetPwm { duty: var("n"), hertz, output }
    };
    let text = |var: Option<&str>, text: &str| Element::FormattedString {
        var: var.map(str::to_owned),
        text: text.to_owned(),
        quoted: true,
    };
    let flags = |negated, set, reset| Element::Coil { name: "Yq".to_owned(), negated, set, reset, ttrigger: None };
    let delay = Element::Timer { kind: TimerKind::Ton, name: "Tt".to_owned(), delay: var("n"), adjust: None };
    let max = Element::Counter { kind: CounterKind::Ctu, name: name(), max: var("m"), init: None, input: None };
    #[rustfmt::skip]
    let cases: Vec<(Element, &str)> = vec![
        // Element, and part of the reason; an empty reason means that the element is supported.
        (Element::Placeholder,                                                      "not complete"),
        (Element::ShiftRegister { name: name(), stages: 3 },                        ""),
        (Element::LookUpTable { dest: name(), index: constant(0), as_string: false, values: vec![32_768], name: None }, "a value of the table is 32768"),
        (Element::LookUpTable { dest: name(), index: constant(0), as_string: false, values: vec![], name: None }, ""),
        (curve(&[]),                                                                "0 point(s)"),
        (curve(&[(0, 0)]),                                                          "1 point(s)"),
        (curve(&[(0, 0), (0, 1)]),                                                  "x must rise"),
        (curve(&[(0, 0), (-1, 1)]),                                                 "x must rise"),
        (curve(&[(0, 0), (181, 181)]),                                              ""),
        (curve(&[(0, 0), (1, 32_767)]),                                             ""),
        (curve(&[(0, 0), (2, 16_384)]),                                             "does not fit -32767 to 32767"),
        (curve(&[(-1, 0), (32_767, 0)]),                                            "the segment of 32768 by 0"),
        (curve(&[(0, 0), (1, 40_000)]),                                             "a coordinate is 40000"),
        (Element::ReadAdc { name: "Ain".to_owned(), refs: None },                   ""),
        (Element::ReadAdc { name: "Ain".to_owned(), refs: Some(1) },                "reference selection is 1"),
        (pwm(constant(1000), None),                                                 ""),
        (pwm(constant(0), None),                                                    "no constant of at least 1 Hz"),
        (pwm(var("n"), None),                                                       "no constant of at least 1 Hz"),
        (pwm(constant(1000), Some("0-100")),                                        "dialect ldmicro-5"),
        (Element::UartRecv { name: name(), rest: transfer(1, 0) },                    ""),
        (Element::UartRecv { name: name(), rest: transfer(2, 0) },                    "2 byte(s) with wait 0"),
        (Element::UartSend { name: name(), rest: transfer(1, 1) },                    "1 byte(s) with wait 1"),
        (Element::Persist { name: name() },                                         ""),
        (text(None, "a"),                                                           ""),
        (text(None, "\\q"),                                                         "`\\q` is not an escape"),
        (text(None, "\\3"),                                                         "needs its variable"),
        (text(Some("n"), "a"),                                                      "takes none"),
        (text(Some("n"), "\\-5"),                                                   ""),
        (text(Some("Ra"), "\\-5"),                                                  "`Ra` is a bit"),
        (timer("Tt", 19_999),                                 "19999 us / 10000 us - 1 = 0 scans, wanted 1 to 32767"),
        (timer("Tt", 20_000),                                                       ""),
        (timer("Tt", 327_689_999),                                                  ""),
        (timer("Tt", 327_690_000),                                                  "= 32768 scans"),
        (timer("Tt", 0),                                                            "= -1 scans"),
        (timer("Tt", i64::MIN),                                                     "wanted 1 to 32767"),
        (timer("Tt", i64::MAX),                                                     "wanted 1 to 32767"),
        (delay,                                                                     "a delay in a variable belongs to dialect ldmicro-5"),
        (with(-1),                                                                  ""),
        (with(0),                                                                   "belongs to dialect ldmicro-5"),
        (timer("Ra", 50_000),                                                       "`Ra` is a bit"),
        (counter("Cn", 32_767),                                                     ""),
        (counter("Cn", 32_768),                                                     "the limit of a counter is 32768"),
        (counter("Cn", -32_769),                                                    "the limit of a counter is -32769"),
        (max,                                                                       "the variable `m` as the limit of a counter belongs to dialect ldmicro-5"),
        (count(Some(0), Some('/')),                                                 ""),
        (count(Some(1), None),                                                      "start value"),
        (count(None, Some('\\')),                                                   "input kind `\\`"),
        (move_constant("n", 32_768),                                                           "an operand is 32768"),
        (move_constant("n", -32_768),                                                          ""),
        (move_constant("Ra", 1),                                                               "`Ra` is a bit"),
        (Element::Res { name: "Ra".to_owned() },                                    "`Ra` is a bit"),
        (Element::Compare { op: CompareOp::Equ, op1: var("Ra"), op2: constant(0) }, "`Ra` is a bit"),
        (Element::Math { op: MathOp::Add, dest: name(), op1: var("n"), op2: constant(-40_000) }, "an operand is -40000"),
        (contacts("lamp", false),                                                   "`lamp` is not a bit"),
        (Element::Contacts { name: "Xa".to_owned(), negated: false, set1: Some(0) }, ""),
        (Element::Contacts { name: "Xa".to_owned(), negated: false, set1: Some(1) }, "a third argument other than 0 belongs to dialect ldmicro-5"),
        (coil("Xa"),                                                                "`Xa` is an input"),
        (coil("lamp"),                                                              "`lamp` is not a bit"),
        (flags(true, true, false),                                                  "at most one"),
        (flags(false, true, true),                                                  "at most one"),
        (flags(true, false, true),                                                  "at most one"),
        (Element::Coil { name: "Yq".to_owned(), negated: false, set: false, reset: false, ttrigger: Some(1) }, "a fourth flag other than 0 belongs to dialect ldmicro-5"),
        (Element::Odr, "ODR belongs to dialect ldmicro-5"),
        (Element::Osc, "OSC belongs to dialect ldmicro-5"),
    ];
    for (element, reason) in cases {
        expect(&element, reason, refusal(|_| {}, element.clone()));
    }
    let placeholder = refusal(|_| {}, Element::Placeholder).map_err(|e| e.to_string());
    let refusal_text = "rung 2, element 3: `PLACEHOLDER`: an empty place: the rung is not complete";
    assert_eq!(placeholder, Err(refusal_text.to_owned()));
    let npulse = |hertz| Element::Npulse { count: constant(3), hertz, coil: "Yq".to_owned() };
    #[rustfmt::skip]
    let in_dialect_5: Vec<(Element, &str)> = vec![
        (timer("Tt", 10_000),                                                       ""),
        (flags(true, true, false),                                                  ""),
        (Element::Odr,                                                              ""),
        (with(0),                                                                   ""),
        (with(-5),                                                                  ""),
        (timer("Tt", i64::MAX),                                                     "wanted 1 to 2147483647"),
        (max5,                                                                      ""),
        (count(Some(1), Some('o')),                                                 ""),
        (count(Some(1), Some('?')),                                                 "input kind `?` has no meaning"),
        (counter("Cn", 1 << 31),                                                    "the limit of a counter is 2147483648"),
        (move_constant("n", -1 << 31),                                                         ""),
        (move_constant("n", 1 << 31),                                                          "an operand is 2147483648"),
        (curve(&[(0, 0), (2, 16_384)]),                                             "does not fit -32767 to 32767"),
        (curve(&[(0, 0), (2, 16_384), (40_000, 0)]),                                ""),
        (curve(&[(0, 0), (70_000, 70_000)]),                                        "does not fit -2147483647 to 2147483647"),
        (pwm(constant(1000), Some("0-100")),                                        ""),
        (pwm(constant(1000), Some("")),                                             ""),
        (pwm(constant(1000), Some("0-256")),                                        "the resolution `0-256`"),
        (Element::UartSend { name: name(), rest: transfer(2, 0) },                    ""),
        (Element::UartSend { name: name(), rest: transfer(3, 0) },                    "3 byte(s) with wait 0"),
        (Element::UartSend { name: name(), rest: transfer(2, 1) },                    ""),
        (Element::UartSend { name: name(), rest: transfer(1, 1) },                    ""),
        (Element::ReadAdc { name: "Ain".to_owned(), refs: Some(3) },                ""),
        (Element::ReadAdc { name: "Ain".to_owned(), refs: Some(4) },                "reference selection is 4"),
        (Element::UartRecv { name: name(), rest: transfer(1, 1) },                    ""),
        (Element::UartRecv { name: name(), rest: transfer(2, 0) },                    ""),
        (Element::UartRecv { name: name(), rest: transfer(2, 1) },                    ""),
        (npulse(constant(50)),                                                      ""),
        (npulse(constant(51)),                                                      "at least one scan of 10000 us"),
        (npulse(constant(0)),                                                       "at least one scan"),
        (npulse(var("n")),                                                          "constant"),
    ];
    for (element, reason) in in_dialect_5 {
        expect(&element, reason, refusal(|p| p.dialect = LadderDialect::Ldmicro5, element.clone()));
    }
    let no_rate = |p: &mut ladder::LadderProgram| p.settings.baud = None;
    for element in [Element::UartSend { name: name(), rest: None }, text(None, "a")] {
        expect(&element, "BAUD= is missing", refusal(no_rate, element.clone()));
    }
    let first = vec![leaf(pwm(constant(1000), None))];
    let two = |second: Element| Evaluator::new(&program(vec![first.clone(), vec![leaf(second)]])).map(|_| ());
    assert_eq!(two(pwm(constant(1000), None)), Ok(()));
    assert!(two(pwm(constant(1001), None)).is_err_and(|e| e.why.to_string().contains("another frequency")));
    let free_running = refusal(|p| p.settings.cycle_us = 0, timer("Tt", 50_000));
    expect(&timer("Tt", 50_000), "CYCLE is 0", free_running);
}

fn expect(element: &Element, reason: &str, found: Result<(), UnsupportedElement>) {
    match found {
        Ok(()) => assert!(reason.is_empty(), "{element:?}: accepted, wanted `{reason}`"),
        Err(refusal) => {
            assert!(
                !reason.is_empty() && refusal.why.to_string().contains(reason),
                "{element:?}: {refusal}, wanted `{reason}`"
            );
            assert_eq!(refusal.element, ElementId { rung: 1, index: 2 }, "{refusal}");
            assert!(refusal.to_string().starts_with("rung 2, element 3: `"), "{refusal}");
            assert!(!refusal.text.is_empty(), "{refusal}");
        }
    }
}
