//! Property tests: random programs survive a round trip; random and damaged text never panics.

use diag::Pos;
use ladder::il::{
    self, AddressArea, AddressSize, DirectAddress, IecType, IlBinaryOperand, IlBinaryOperator, IlBlockInput,
    IlCondition, IlInstruction, IlLiteral, IlName, IlOperand, IlOperandKind, IlOperation, IlParameter, IlProgram,
    IlQualifier, IlSection, IlValue, IlVariable, StandardBlock,
};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;

fn named(text: String) -> IlName {
    IlName { text, pos: Pos::default() }
}

/// Names that begin with `v_` or `x`, so that none is a keyword or near an operator.
fn text() -> impl Strategy<Value = String> {
    "(v_|xy)[A-Za-z0-9_]{3,9}"
}

fn name() -> impl Strategy<Value = IlName> {
    text().prop_map(named)
}

fn literal() -> impl Strategy<Value = IlLiteral> {
    let integers: Vec<IecType> = IecType::elementary().filter(|t| t.range().is_some() && *t != IecType::Bool).collect();
    let bare = |value| IlLiteral { prefix: None, value };
    let integer = prop_oneof![
        any::<i64>().prop_map(|value| IlValue::Integer { value: value.max(-i64::MAX), base: 10 }),
        (0..=i64::MAX, select(vec![2_u32, 8, 16])).prop_map(|(value, base)| IlValue::Integer { value, base }),
    ];
    prop_oneof![
        any::<bool>().prop_map(move |value| bare(IlValue::Bool(value))),
        any::<bool>().prop_map(|value| IlLiteral { prefix: Some(IecType::Bool), value: IlValue::Bool(value) }),
        (option::of(select(integers)), integer).prop_map(|(prefix, value)| IlLiteral { prefix, value }),
        any::<i64>().prop_map(move |nanoseconds| bare(IlValue::Time(nanoseconds))),
        (0_i64..100_000).prop_map(move |ms| bare(IlValue::Time(ms * 1_000_000))),
    ]
}

fn address() -> impl Strategy<Value = DirectAddress> {
    let areas = vec![AddressArea::Input, AddressArea::Output, AddressArea::Memory];
    let sizes = vec![AddressSize::Bit, AddressSize::Byte, AddressSize::Word, AddressSize::Double];
    (select(areas), option::of(select(sizes)), vec(any::<u32>(), 1..=8)).prop_map(|(area, size, path)| DirectAddress {
        area,
        size,
        path,
    })
}

fn target() -> impl Strategy<Value = IlOperand> {
    let kind = prop_oneof![
        (text(), option::of(text())).prop_map(|(name, member)| IlOperandKind::Variable { name, member }),
        address().prop_map(IlOperandKind::Address),
    ];
    kind.prop_map(|kind| IlOperand { kind, pos: Pos::default() })
}

fn operand() -> impl Strategy<Value = IlOperand> {
    let literal = literal().prop_map(|l| IlOperand { kind: IlOperandKind::Literal(l), pos: Pos::default() });
    prop_oneof![target(), literal]
}

/// Parameters of one kind, each name once.
fn parameters() -> impl Strategy<Value = Vec<IlParameter>> {
    let output = (any::<bool>(), target());
    let named_ones = (vec(operand(), 0..4), vec(output, 0..3)).prop_map(|(inputs, outputs)| {
        let inputs = inputs.into_iter().enumerate();
        let inputs = inputs.map(|(i, value)| IlParameter::Input { name: named(format!("in_{i}")), value });
        let outputs = outputs.into_iter().enumerate().map(|(i, (negated, target))| IlParameter::Output {
            negated,
            name: named(format!("out_{i}")),
            target,
        });
        inputs.chain(outputs).collect()
    });
    prop_oneof![named_ones, vec(operand().prop_map(IlParameter::Positional), 0..5)]
}

fn condition() -> impl Strategy<Value = IlCondition> {
    select(vec![IlCondition::Always, IlCondition::IfTrue, IlCondition::IfFalse])
}

fn function() -> impl Strategy<Value = IlOperation> {
    let make =
        |name: String, parenthesized, arguments| IlOperation::Function { name: named(name), parenthesized, arguments };
    let positional = |range| vec(operand().prop_map(IlParameter::Positional), range);
    let operators: Vec<String> = IlBinaryOperator::ALL.iter().map(|(_, k)| (*k).to_owned()).collect();
    let own = "z_fun_[a-z]{9}_[0-9]{4}";
    prop_oneof![
        (own, parameters()).prop_map(move |(name, arguments)| make(name, true, arguments)),
        (own, positional(1..4)).prop_map(move |(name, arguments)| make(name, false, arguments)),
        (select(operators), positional(2..4)).prop_map(move |(name, arguments)| make(name, false, arguments)),
        (select(vec!["MAX", "ABS", "INT_TO_DINT", "SEL"]), positional(0..4)).prop_map(move |(name, arguments)| make(
            name.to_owned(),
            false,
            arguments
        )),
    ]
}

/// Operations without `(`, `)` and jumps.
fn simple() -> impl Strategy<Value = IlOperation> {
    let binary = select(IlBinaryOperator::ALL.map(|(operator, _)| operator).to_vec());
    let input = select(IlBlockInput::ALL.map(|(input, _)| input).to_vec());
    let block = select(StandardBlock::ALL.into_iter().filter(|b| b.preset().is_some()).collect::<Vec<_>>());
    prop_oneof![
        (any::<bool>(), operand()).prop_map(|(negated, operand)| IlOperation::Load { negated, operand }),
        (any::<bool>(), target()).prop_map(|(negated, target)| IlOperation::Store { negated, target }),
        target().prop_map(IlOperation::Set),
        target().prop_map(IlOperation::Reset),
        Just(IlOperation::Not),
        select(vec!["S", "R"]).prop_map(|operator| IlOperation::NoTarget { operator }),
        (binary, any::<bool>(), operand()).prop_map(|(operator, negated, operand)| IlOperation::Binary {
            operator,
            negated: negated && operator.is_logic(),
            operand: IlBinaryOperand::Value(operand),
        }),
        (condition(), name(), parameters()).prop_map(|(condition, instance, parameters)| IlOperation::Call {
            condition,
            instance,
            parameters,
        }),
        (input, name()).prop_map(|(input, instance)| IlOperation::BlockInput { input, instance }),
        (block, name(), operand()).prop_map(|(block, instance, preset)| IlOperation::ShortBlock {
            block,
            instance,
            preset
        }),
        function(),
    ]
}

fn comment() -> impl Strategy<Value = Option<String>> {
    let text = "[!-~é]([ -~é]{0,20}[!-~é])?";
    option::of(text.prop_map(|text: String| text.replace("*)", "* )")))
}

fn line(operation: Option<IlOperation>, comment: Option<String>) -> IlInstruction {
    IlInstruction { operation, comment, ..IlInstruction::default() }
}

/// A part of a body: lines, or a parenthesis around a part.
fn part() -> BoxedStrategy<Vec<IlInstruction>> {
    let one = (simple(), comment()).prop_map(|(operation, comment)| vec![line(Some(operation), comment)]);
    one.prop_recursive(6, 40, 4, |inner| {
        let binary = select(IlBinaryOperator::ALL.map(|(operator, _)| operator).to_vec());
        let opening = (binary, any::<bool>(), option::of(operand())).prop_map(|(operator, negated, operand)| {
            let negated = negated && operator.is_logic();
            line(Some(IlOperation::Binary { operator, negated, operand: IlBinaryOperand::Deferred(operand) }), None)
        });
        (opening, vec(inner, 0..4), comment()).prop_map(|(opening, inner, comment)| {
            let close = line(Some(IlOperation::Close), comment);
            std::iter::once(opening).chain(inner.into_iter().flatten()).chain([close]).collect()
        })
    })
    .boxed()
}

/// A body with labels at some of its outer lines, and jumps to them at its end.
fn body() -> impl Strategy<Value = Vec<IlInstruction>> {
    (vec((part(), any::<bool>()), 0..8), vec((condition(), any::<prop::sample::Index>()), 0..4), comment()).prop_map(
        |(parts, jumps, last)| {
            let mut lines = Vec::new();
            let mut labels = Vec::new();
            for (mut part, has_label) in parts {
                if has_label {
                    let label = format!("L{}", labels.len());
                    part[0].label = Some(named(label.clone()));
                    labels.push(label);
                }
                lines.extend(part);
            }
            for (condition, index) in jumps.iter().filter(|_| !labels.is_empty()) {
                let label = named(index.get(&labels).clone());
                lines.push(line(Some(IlOperation::Jump { condition: *condition, label }), None));
                lines.push(line(Some(IlOperation::Return(*condition)), None));
            }
            lines.extend(last.map(|last| line(None, Some(last))));
            lines
        },
    )
}

fn variable() -> impl Strategy<Value = IlVariable> {
    let elementary = (select(IecType::elementary().collect::<Vec<_>>()), option::of(address()), option::of(literal()));
    let block = select(StandardBlock::ALL.to_vec()).prop_map(|block| (IecType::Block(block), None, None));
    let sections = select(IlSection::ALL.map(|(section, _)| section).to_vec());
    let qualifiers = option::of(select(vec![IlQualifier::Retain, IlQualifier::Constant]));
    (sections, qualifiers, prop_oneof![elementary, block], comment()).prop_map(
        |(section, qualifier, (iec_type, address, initial), comment)| {
            let name = IlName::default();
            IlVariable { name, section, qualifier, iec_type, address, initial, comment }
        },
    )
}

fn program() -> impl Strategy<Value = IlProgram> {
    (option::of(name()), vec(variable(), 0..8), body(), comment()).prop_map(
        |(name, mut variables, instructions, remark)| {
            for (index, variable) in variables.iter_mut().enumerate() {
                variable.name = named(format!("declared_{index}"));
            }
            let has_head = name.is_some() || !variables.is_empty();
            let remarks = remark.into_iter().filter(|_| has_head).collect();
            IlProgram { file: String::new(), name, remarks, variables, instructions }
        },
    )
}

proptest! {
    #[test]
    fn a_program_survives_the_round_trip(program in program()) {
        let text = il::write(&program);
        let parsed = il::read("t.il", &text);
        prop_assert!(parsed.is_ok(), "{:?}\n{}", parsed, text);
        let again = parsed.expect("checked").program;
        prop_assert_eq!(&again.clone().without_positions(), &program, "{}", text);
        prop_assert_eq!(&il::write(&again), &text);
        // The check accepts every program that reads, without a panic.
        let _ = il::check(&again);
        prop_assert_eq!(il::result_types(&again).len(), again.instructions.len());
        // So does the resolution, which has an element for each label and operation.
        match il::to_ladder(&again, il::il_settings(10_000)) {
            Ok(resolved) => {
                let lines = again.instructions.iter().filter(|l| l.label.is_some() || l.operation.is_some());
                let is_line = |element: &ladder::Element| matches!(element, ladder::Element::Instruction(_));
                let elements = resolved.program.elements().filter(|at| is_line(at.element));
                prop_assert_eq!(elements.count(), lines.count(), "{}", text);
            }
            Err(diagnostics) => prop_assert!(diagnostics.iter().any(diag::Diagnostic::is_error)),
        }
    }

    #[test]
    fn any_file_is_read_or_refused(bytes in vec(any::<u8>(), 0..80), head in select(vec!["", "PROGRAM p\n", "VAR\n", "<", "{", "(*", "LD a\n", "LDmicro"]), name in select(vec!["t", "t.il", "t.ld", "t.st"])) {
        let file = [head.as_bytes(), &bytes].concat();
        if let Err(diagnostics) = ladder::read_program(name, &file, ladder::ReadOptions::default()) {
            prop_assert!(diagnostics.iter().any(diag::Diagnostic::is_error));
            prop_assert!(diagnostics.iter().all(|d| !d.cause.is_empty() && !d.hint.is_empty() && d.file == name));
        }
    }

    #[test]
    fn accepted_text_reads_equal_again(program in program(), cuts in vec((any::<prop::sample::Index>(), ".{0,3}"), 1..4)) {
        let mut damaged: Vec<char> = il::write(&program).chars().collect();
        for (at, with) in cuts {
            let at = at.index(damaged.len() + 1);
            let end = (at + 1).min(damaged.len());
            damaged.splice(at..end, with.chars());
        }
        let text: String = damaged.into_iter().collect();
        match il::read("t.il", &text) {
            Ok(parsed) => {
                let written = il::write(&parsed.program);
                let again = il::read("t.il", &written);
                prop_assert!(again.is_ok(), "{:?}\n{}\n--\n{}", again, text, written);
                let again = again.expect("checked").program;
                prop_assert_eq!(again.without_positions(), parsed.program.clone().without_positions(), "{}", text);
                let _ = il::check(&parsed.program);
            }
            Err(diagnostics) => prop_assert!(diagnostics.iter().any(diag::Diagnostic::is_error)),
        }
    }

    #[test]
    fn any_text_is_read_or_refused(text in "(LD |ST |AND|\\(|\\)|\n|,|:=|=>|VAR|END_VAR|;|:|a|5|T#1s|%IX0|CAL |\\(\\*|\\*\\)|.){0,60}") {
        if let Ok(parsed) = il::read("t.il", &text) {
            let again = il::read("t.il", &il::write(&parsed.program)).map(|p| p.program.without_positions());
            prop_assert_eq!(again, Ok(parsed.program.without_positions()));
        }
    }
}
