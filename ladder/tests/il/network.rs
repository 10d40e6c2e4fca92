//! Networks as ladder diagram: random ones survive the way through instructions, and the lines that no
//! diagram has are named.

use diag::Pos;
use ladder::il::{
    self, CoilKind, IecType, IlBinaryOperator, IlCondition, IlLiteral, IlName, IlOperand, IlOperandKind, IlParameter,
    IlProgram, IlSection, IlValue, IlVariable, LadderBlock, LadderLogic, LadderNetwork, LadderOutput, LadderStage,
    StandardBlock, instructions_of, ladder_of,
};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;

const BITS: [&str; 5] = ["a", "b", "c", "d", "e"];
const NUMBERS: [&str; 2] = ["x", "y"];
const INSTANCES: [(&str, StandardBlock); 4] =
    [("t1", StandardBlock::Ton), ("c1", StandardBlock::Ctud), ("s1", StandardBlock::Sr), ("r1", StandardBlock::RTrig)];

fn named(text: &str) -> IlName {
    IlName { text: text.to_owned(), pos: Pos::default() }
}

fn variable(name: &str, member: Option<&str>) -> IlOperand {
    let kind = IlOperandKind::Variable { name: name.to_owned(), member: member.map(str::to_owned) };
    IlOperand { kind, pos: Pos::default() }
}

fn number(value: i64) -> IlOperand {
    let literal = IlLiteral { prefix: None, value: IlValue::Integer { value, base: 10 } };
    IlOperand { kind: IlOperandKind::Literal(literal), pos: Pos::default() }
}

fn bit() -> impl Strategy<Value = IlOperand> {
    prop_oneof![
        4 => select(BITS.to_vec()).prop_map(|name| variable(name, None)),
        1 => Just(variable("t1", Some("Q"))),
    ]
}

fn value() -> impl Strategy<Value = IlOperand> {
    prop_oneof![select(NUMBERS.to_vec()).prop_map(|name| variable(name, None)), (-9_i64..10).prop_map(number)]
}

fn leaf() -> impl Strategy<Value = LadderLogic> {
    let comparisons: Vec<IlBinaryOperator> =
        IlBinaryOperator::ALL.iter().map(|(operator, _)| *operator).filter(|o| o.is_comparison()).collect();
    prop_oneof![
        6 => (any::<bool>(), bit()).prop_map(|(negated, operand)| LadderLogic::Contact { negated, operand }),
        2 => (select(comparisons), value(), value()).prop_map(|(operator, left, right)| LadderLogic::Compare {
            operator,
            left,
            right
        }),
        1 => Just(LadderLogic::Wire),
        1 => Just(LadderLogic::Open),
    ]
}

fn logic() -> BoxedStrategy<LadderLogic> {
    let tree = leaf().prop_recursive(5, 24, 4, |inner| {
        (any::<bool>(), vec(inner, 2..5)).prop_map(|(is_series, parts)| {
            let join = if is_series { LadderLogic::and } else { LadderLogic::or };
            parts.into_iter().reduce(join).unwrap_or(LadderLogic::Wire)
        })
    });
    tree.boxed()
}

fn condition() -> impl Strategy<Value = IlCondition> {
    select(vec![IlCondition::Always, IlCondition::IfTrue, IlCondition::IfFalse])
}

fn block() -> impl Strategy<Value = LadderBlock> {
    let parameter = |part: ladder::il::BlockPart, is_literal: bool| {
        let value = match part.iec_type() {
            IecType::Bool => variable("a", None),
            IecType::Time => {
                let literal = IlLiteral { prefix: None, value: IlValue::Time(500_000_000) };
                IlOperand { kind: IlOperandKind::Literal(literal), pos: Pos::default() }
            }
            _ if is_literal => number(7),
            _ => variable("x", None),
        };
        let name = named(part.name);
        match part.is_input {
            true => IlParameter::Input { name, value },
            false => IlParameter::Output { negated: part.name == "QD", name, target: value },
        }
    };
    (select(INSTANCES.to_vec()), condition(), option::of(any::<prop::sample::Index>()), vec(any::<bool>(), 16))
        .prop_map(move |((name, block), condition, power, choices)| {
            let bits: Vec<_> =
                block.parts().iter().filter(|part| part.is_input && part.iec_type() == IecType::Bool).collect();
            let powered =
                power.filter(|_| condition == IlCondition::Always).map(|power| power.get(&bits).name.to_owned());
            let parts = block.parts().iter().zip(&choices);
            let parts = parts
                .filter(|(part, is_given)| **is_given && part.name != "ET" && Some(part.name) != powered.as_deref());
            let parameters = parts.map(|(part, _)| parameter(*part, choices[0] && part.is_input)).collect();
            LadderBlock { block, instance: named(name), condition, powered, parameters }
        })
}

fn output() -> impl Strategy<Value = LadderOutput> {
    let kinds = vec![CoilKind::Store, CoilKind::Negated, CoilKind::Set, CoilKind::Reset];
    prop_oneof![
        (select(kinds), select(BITS.to_vec()))
            .prop_map(|(kind, name)| LadderOutput::Coil { kind, target: variable(name, None) }),
        block().prop_map(LadderOutput::Block),
    ]
}

fn stage() -> impl Strategy<Value = LadderStage> {
    (logic(), vec(output(), 1..4)).prop_map(|(logic, outputs)| LadderStage { logic, outputs })
}

fn network() -> impl Strategy<Value = LadderNetwork> {
    let end = option::of((any::<bool>(), condition()));
    (vec(stage(), 1..4), end, vec("[a-z]{1,9}( [a-z]{1,9})?", 0..3)).prop_map(|(mut stages, end, comments)| {
        if let (Some((is_jump, condition)), Some(last)) = (end, stages.last_mut()) {
            let jump = LadderOutput::Jump { condition, label: named("Again") };
            last.outputs.push(if is_jump { jump } else { LadderOutput::Return(condition) });
        }
        LadderNetwork { label: Some(named("Again")), comments, stages }
    })
}

/// A program of one network, with its variables.
fn program(network: &LadderNetwork) -> IlProgram {
    let declare = |name: &str, iec_type| IlVariable {
        name: named(name),
        section: IlSection::Local,
        qualifier: None,
        iec_type,
        address: None,
        initial: None,
        comment: None,
    };
    let bits = BITS.iter().map(|name| declare(name, IecType::Bool));
    let numbers = NUMBERS.iter().map(|name| declare(name, IecType::Int));
    let blocks = INSTANCES.iter().map(|(name, block)| declare(name, IecType::Block(*block)));
    let variables = bits.chain(numbers).chain(blocks).collect();
    let instructions = instructions_of(network);
    IlProgram { file: "random.il".to_owned(), variables, instructions, ..IlProgram::default() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn a_network_survives_its_instructions(network in network()) {
        let program = program(&network);
        let ladder = il::to_ladder(&program, il::il_settings(10_000));
        let ladder = ladder.unwrap_or_else(|faults| panic!("{faults:#?}\n{}", il::write(&program))).program;
        prop_assert_eq!(ladder.rungs.len(), 1, "{}", il::write(&program));
        let seen = ladder_of(&ladder.rungs[0]).unwrap_or_else(|why| panic!("{why}\n{}", il::write(&program)));
        prop_assert_eq!(seen, network, "{}", il::write(&program));
    }

    #[test]
    fn a_double_complement_changes_nothing(logic in logic()) {
        prop_assert_eq!(logic.clone().complement().complement(), logic);
    }
}

/// The diagram of the first network of a text: its instructions, or the line that has none.
fn diagram(text: &str) -> String {
    let read = il::read("t.il", text).unwrap_or_else(|faults| panic!("{faults:#?}")).program;
    let ladder = il::to_ladder(&read, il::il_settings(10_000)).unwrap_or_else(|faults| panic!("{faults:#?}")).program;
    match ladder_of(&ladder.rungs[0]) {
        Ok(network) => {
            let program = IlProgram { instructions: instructions_of(&network), ..IlProgram::default() };
            let lines: Vec<String> = il::write(&program).lines().map(|line| line.trim().to_owned()).collect();
            lines.join("; ")
        }
        Err(why) => format!("line {}: {why}", why.pos.line),
    }
}

#[test]
fn spellings_of_one_diagram() {
    let blocks = "VAR\n a, b, c : BOOL; x, y : INT; t : TON; n : CTU;\nEND_VAR\n";
    let cases = [
        ("LD a\nNOT\nAND(\nLD b\nORN c\n)\nST c", "LDN a; AND( b; ORN c; ); ST c"),
        ("LD a\nANDN( b\nOR c\n)\nST c", "LD a; ANDN b; ANDN c; ST c"),
        ("LD a\nIN t", "LD a; ST t.IN; CAL t"),
        ("LD a\nTON t, 250", "LD a; ST t.IN; CAL t(PT := T#250ms)"),
        ("CAL n(a, b, 3)", "CAL n(CU := a, R := b, PV := 3)"),
        ("LD a\nST n.R\nCAL n(CU := b)", "LD a; ST n.R; CAL n(CU := b)"),
        ("LD a\nST b\nAND c\nR b", "LD a; ST b; AND c; R b"),
        ("LD a\nEQ b\nST c", "LD a; EQ b; ST c"),
        (
            "LD a\nST b\nOR c\nST a",
            "line 6: `OR c` has no ladder diagram: behind an output the power can only go on through AND",
        ),
        ("LD a\nXOR b\nST c", "line 5: `XOR b` has no ladder diagram: contacts have only AND and OR"),
        ("LD x\nADD y\nST x", "line 5: `ADD y` has no ladder diagram: contacts have only AND and OR"),
        ("LD x\nST y", "line 5: `ST y` has no ladder diagram: a coil is a BOOL"),
        ("LD x\nMAX y\nGT 3\nST a", "line 5: `MAX y` has no ladder diagram: functions are no contacts"),
    ];
    for (text, wanted) in cases {
        assert_eq!(diagram(&format!("{blocks}{text}\n")), wanted, "{text}");
    }
}
