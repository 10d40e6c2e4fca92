//! Random typed programs in Instruction List: all are accepted, written as the same program, and every value
//! stays in the range of its type.

use std::fmt::Write as _;

use ladder_eval::Evaluator;
use proptest::prelude::*;

const NUMBERS: [&str; 10] = ["SINT", "INT", "DINT", "USINT", "UINT", "UDINT", "BYTE", "WORD", "DWORD", "TIME"];
const BLOCKS: [(&str, &str, &str); 12] = [
    ("TON", "IN", "Q"),
    ("TOF", "IN", "Q"),
    ("TP", "IN", "Q"),
    ("TONA", "IN", "Q"),
    ("TOFA", "IN", "Q"),
    ("CTU", "CU", "Q"),
    ("CTD", "CD", "Q"),
    ("CTUD", "CU", "QU"),
    ("R_TRIG", "CLK", "Q"),
    ("F_TRIG", "CLK", "Q"),
    ("SR", "S1", "Q1"),
    ("RS", "S", "Q1"),
];

/// Draws the choices of a program.
struct Draw(u64);

impl Draw {
    fn below(&mut self, count: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % count as u64) as usize
    }

    fn one<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.below(of.len())]
    }
}

/// The text of a program: each variable has the name of its type, and a number.
struct Text {
    draw: Draw,
    text: String,
    labels: usize,
}

impl Text {
    fn line(&mut self, line: impl AsRef<str>) {
        self.text += line.as_ref();
        self.text.push('\n');
    }

    fn variable(&mut self, of: &str) -> String {
        format!("v{}_{}", of.to_ascii_lowercase(), self.draw.below(2))
    }

    /// A variable or a constant of the type.
    fn operand(&mut self, of: &str) -> String {
        if self.draw.below(3) > 0 {
            return self.variable(of);
        }
        match of {
            "BOOL" => self.draw.one(&["TRUE", "FALSE"]).to_owned(),
            "TIME" => format!("T#{}ms", [0, 1, 35, 2_147_483_647][self.draw.below(4)]),
            "SINT" | "INT" | "DINT" => self.draw.one(&["-128", "-1", "0", "1", "127"]).to_owned(),
            _ => self.draw.one(&["0", "1", "2", "16#80", "255"]).to_owned(),
        }
    }

    /// Lines that leave a result of the type.
    fn value(&mut self, of: &str, depth: usize) {
        let load = if matches!(of, "BOOL" | "BYTE" | "WORD" | "DWORD") { self.draw.one(&["LD", "LDN"]) } else { "LD" };
        let operand = self.operand(of);
        self.line(format!("{load} {operand}"));
        for _ in 0..self.draw.below(4) {
            self.change(of, depth);
        }
        if of == "BOOL" && self.draw.below(3) == 0 {
            let number = self.draw.one(&NUMBERS);
            self.value(number, depth);
            let compare = self.draw.one(&["GT", "GE", "EQ", "NE", "LE", "LT"]);
            let operand = self.operand(number);
            self.line(format!("{compare} {operand}"));
        }
    }

    /// A line, or a parenthesis, that keeps the type of the result.
    fn change(&mut self, of: &str, depth: usize) {
        let operator = match of {
            "BOOL" | "BYTE" | "WORD" | "DWORD" => self.draw.one(&["AND", "ANDN", "OR", "ORN", "XOR", "XORN", "NOT"]),
            "TIME" => self.draw.one(&["ADD", "SUB"]),
            _ => self.draw.one(&["ADD", "SUB", "MUL", "DIV", "MOD"]),
        };
        let operand = self.operand(of);
        match self.draw.below(5) {
            _ if operator == "NOT" => self.line("NOT"),
            0 if depth > 0 => {
                self.line(format!("{operator}("));
                self.value(of, depth - 1);
                self.line(")");
            }
            1 if depth > 0 => {
                self.line(format!("{operator}( {operand}"));
                self.change(of, depth - 1);
                self.line(")");
            }
            2 if of != "TIME" && !matches!(of, "BOOL" | "BYTE" | "WORD" | "DWORD") => {
                let function = self.draw.one(&["MAX", "MIN"]);
                self.line(format!("{function} {operand}"));
            }
            _ => self.line(format!("{operator} {operand}")),
        }
    }

    fn network(&mut self) {
        match self.draw.below(8) {
            0 => {
                let (_, input, _) = BLOCKS[self.draw.below(BLOCKS.len())];
                self.value("BOOL", 1);
                let block = BLOCKS.iter().position(|(_, known, _)| *known == input).unwrap_or(0);
                let call = self.draw.one(&["CAL", "CALC", "CALCN"]);
                self.line(format!("{call} b{block}({input} := vbool_0)"));
            }
            1 => {
                let (number, (_, input, output)) = pick(&mut self.draw);
                let (target, preset) = (self.variable("BOOL"), ["", "PT := T#35ms, ", "PV := 2, "][preset(number)]);
                let source = self.variable("BOOL");
                self.line(format!("CAL b{number}({preset}{input} := {source}, {output} => {target})"));
            }
            2 => {
                self.value("BOOL", 2);
                let (operator, target) = (self.draw.one(&["S", "R"]), self.variable("BOOL"));
                self.line(format!("{operator} {target}"));
            }
            3 => {
                self.value("BOOL", 1);
                let (jump, label) = (self.draw.one(&["JMPC", "JMPCN"]), self.draw.below(self.labels));
                self.line(format!("{jump} label_{label}"));
            }
            _ => {
                let of = if self.draw.below(2) == 0 { "BOOL" } else { self.draw.one(&NUMBERS) };
                self.value(of, 2);
                let target = self.variable(of);
                let store = if matches!(of, "BOOL" | "BYTE") { self.draw.one(&["ST", "STN"]) } else { "ST" };
                self.line(format!("{store} {target}"));
            }
        }
    }
}

fn pick(draw: &mut Draw) -> (usize, (&'static str, &'static str, &'static str)) {
    let number = draw.below(BLOCKS.len());
    (number, BLOCKS[number])
}

/// 1 for blocks with PT, 2 for those with PV, 0 for the others.
fn preset(number: usize) -> usize {
    match number {
        0..5 => 1,
        5..8 => 2,
        _ => 0,
    }
}

fn program(seed: u64) -> String {
    let mut text = Text { draw: Draw(seed | 1), text: String::new(), labels: 3 };
    text.line("VAR");
    for of in NUMBERS.iter().chain(&["BOOL"]) {
        let lower = of.to_ascii_lowercase();
        text.line(format!("  v{lower}_0, v{lower}_1 : {of};"));
    }
    for (number, (block, ..)) in BLOCKS.iter().enumerate() {
        text.line(format!("  b{number} : {block};"));
    }
    text.line("END_VAR");
    for label in 0..text.labels {
        write!(text.text, "label_{label}: ").expect("a string");
        text.line("LD vbool_0");
        text.line("ST vbool_1");
        for _ in 0..4 {
            text.network();
        }
    }
    text.text
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]
    #[test]
    fn values_stay_in_the_ranges_of_their_types(seed in any::<u64>()) {
        let text = program(seed);
        let read = ladder::il::read("t.il", &text);
        prop_assert!(read.is_ok(), "{read:?}\n{text}");
        let settings = ladder::il::il_settings(10_000);
        let resolved = ladder::il::to_ladder(&read.expect("checked").program, settings.clone());
        prop_assert!(resolved.is_ok(), "{resolved:?}\n{text}");
        let program = resolved.expect("checked").program;
        let written = ladder::write(&program);
        let again = ladder::il::read("t.il", &written).map(|read| ladder::il::to_ladder(&read.program, settings));
        let again = again.expect("reads").expect("resolves").program;
        let elements = |program: &ladder::LadderProgram| {
            program.elements().map(|at| (at.id, at.element.clone())).collect::<Vec<_>>()
        };
        prop_assert_eq!(elements(&again), elements(&program), "{}", written);
        let mut eval = Evaluator::new(&program).expect("an evaluator");
        let mut draw = Draw(seed.rotate_left(17) | 1);
        for _ in 0..30 {
            for symbol in 0..eval.symbols().len() {
                if draw.below(4) == 0 && !eval.symbols()[symbol].name.contains('.') {
                    eval.set(symbol, draw.0 as i32);
                }
            }
            eval.scan();
            for (index, symbol) in eval.symbols().iter().enumerate() {
                let ((low, high), value) = (symbol.range(), symbol.shown_value(eval.get(index)));
                prop_assert!((low..=high).contains(&value), "{} is {value}\n{text}", symbol.name);
                // A value is stored with the sign of its width.
                let width = 32 - 8 * u32::from(symbol.bytes.clamp(1, 4));
                let stored = eval.get(index);
                prop_assert!(symbol.kind.is_bit() || stored << width >> width == stored, "{}", symbol.name);
            }
        }
    }
}
