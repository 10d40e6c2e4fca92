//! Random programs: random instructions of the tables with random valid operands, written in the style of
//! each assembler, with numbers in all notations and as sums of two.

use std::fmt::Write;

use emu_core::Chip;
use emu_core::chip::ChipFamily;
use emu_core::rng::Rng;
use emu_core::table::{InstructionRow, OperandSlot};
use emu_test_support::{random_seed, test_folder};

use crate::corpus::{Source, differences};
use crate::judges::Judge;
use crate::ours;

/// Writes a non-negative number in one notation.
type Form = fn(i32) -> String;

const AS31: &[Form] = &[
    |n| n.to_string(),
    |n| format!("0x{n:X}"),
    |n| format!("0{n:x}h"),
    |n| format!("{n:b}b"),
    |n| format!("{n:o}o"),
    |n| format!("{n}d"),
];
const SDAS: &[Form] = &[
    |n| n.to_string(),
    |n| format!("0x{n:x}"),
    |n| format!("0b{n:b}"),
    |n| format!("0o{n:o}"),
    |n| format!("$${n:X}"),
];
const GPASM: &[Form] = &[
    |n| format!("0x{n:X}"),
    |n| format!("0{n:x}h"),
    |n| format!("0{n:X}"),
    |n| format!(".{n}"),
    |n| format!("D'{n}'"),
    |n| format!("h'{n:x}'"),
    |n| format!("B'{n:b}'"),
    |n| format!("O'{n:o}'"),
];
const AVR: &[Form] =
    &[|n| n.to_string(), |n| format!("0x{n:x}"), |n| format!("0b{n:b}"), |n| format!("0{n:o}"), |n| format!("0X{n:X}")];

impl Judge {
    fn forms(self) -> &'static [Form] {
        match self {
            Judge::As31 => AS31,
            Judge::Sdas => SDAS,
            Judge::Gpasm => GPASM,
            Judge::Avr => AVR,
        }
    }

    /// Returns the location counter, and its offset in bytes from the address of the instruction.
    fn here(self, row: &InstructionRow) -> (&'static str, i32) {
        match self {
            Judge::As31 => ("*", 0),
            Judge::Sdas => (".", 0),
            Judge::Gpasm => ("$", 0),
            Judge::Avr => (".", row.len() as i32 * 2),
        }
    }

    /// Returns the chip, the number of instructions in a program, and the text before and after them.
    fn program(self) -> (&'static str, usize, &'static str, &'static str) {
        match self {
            Judge::As31 => ("at89s52", 30_000, "        .org    0\n", "        .end\n"),
            Judge::Sdas => ("at89s52", 30_000, "        .area   CSEG (ABS,CODE)\n        .org    0\n", ""),
            // Error level 2 hides messages about registers of other banks, TRIS and OPTION, and addresses
            // without a register.
            Judge::Gpasm => ("pic16f877a", 8_000, "        list    p=16f877a\n        errorlevel 2\n", "        end\n"),
            Judge::Avr => ("atmega128", 40_000, "", ""),
        }
    }
}

/// Returns a number, plain or as a sum or difference.
fn number(judge: Judge, n: i32, rng: &mut Rng) -> String {
    let forms = judge.forms();
    let form = |n: i32, rng: &mut Rng| forms[rng.below(forms.len() as u64) as usize](n);
    if n < 0 {
        return format!("-{}", form(-n, rng));
    }
    match rng.below(8) {
        0 => {
            let part = rng.below(n as u64 + 1) as i32;
            format!("{} + {}", form(n - part, rng), form(part, rng))
        }
        1 => {
            let part = rng.below(100) as i32;
            format!("({} - {})", form(n + part, rng), form(part, rng))
        }
        _ => form(n, rng),
    }
}

/// Returns the text of an operand.
fn operand(
    judge: Judge,
    chip: &Chip,
    row: &InstructionRow,
    slot: &OperandSlot,
    value: i32,
    pc: i32,
    rng: &mut Rng,
) -> String {
    let width = row.pattern.extract_field(slot.letter, 0).width;
    match slot.kind.name {
        name if name.starts_with("register") => format!("{}{value}", if rng.one_in(2) { "r" } else { "R" }),
        "target" if width < 14 && chip.family != ChipFamily::Pic16 => {
            let bytes = chip.word_bytes as i32;
            let (here, behind) = judge.here(row);
            // Not all assemblers support a jump across the end of memory, so the distance is not wrapped.
            let distance = (value - pc) * bytes - behind;
            format!("{here}{distance:+}")
        }
        "target" if chip.family == ChipFamily::Avr => number(judge, value * 2, rng),
        // Constants may be negative.
        "constant" if width == 8 && rng.one_in(8) && value > 128 => number(judge, value - 256, rng),
        // as31 accepts no expression for a bit.
        "bit address" if judge == Judge::As31 => judge.forms()[rng.below(AS31.len() as u64) as usize](value),
        _ => number(judge, value, rng),
    }
}

/// Returns the text of an instruction of `row` at `pc`, in words, with random operands, or `None` if the
/// assembler does not support the operands.
fn instruction(judge: Judge, chip: &Chip, row: &InstructionRow, pc: u32, rng: &mut Rng) -> Option<String> {
    let site = (chip.isa.locate)(pc, row.len());
    let mut bits = row.pattern.value;
    for slot in row.operands.iter().filter(|s| row.pattern.has_letter(s.letter)) {
        let width = row.pattern.extract_field(slot.letter, 0).width;
        let most = (1u64 << width) - 1;
        let raw = match rng.below(8) {
            0 => 0,
            1 => most,
            _ => rng.below(most + 1),
        };
        bits |= row.pattern.insert_field(slot.letter, raw as u32);
    }
    let values: Vec<i32> = row.operand_values(bits, &site).collect();
    let mut text = String::from(row.mnemonic);
    text.push(' ');
    for c in row.syntax.bytes() {
        match row.operands.iter().position(|s| s.letter == c) {
            Some(i) => {
                let mut value = values[i];
                let kind = row.operands[i].kind.name;
                if kind == "target" {
                    let end = (chip.flash_bytes / chip.word_bytes) as i32;
                    let near = row.pattern.extract_field(c, 0).width < 14 && chip.family != ChipFamily::Pic16;
                    if value >= end || near && (value - pc as i32).abs() > end / 2 {
                        return None;
                    }
                }
                // sdld uses the page of the instruction instead of that of the next one (faults.txt).
                if judge == Judge::Sdas && kind == "target in the page" && pc >> 11 != (pc + 2) >> 11 {
                    return None;
                }
                if kind == "file register" {
                    value |= (rng.below(4) as i32) << 7;
                }
                text += &operand(judge, chip, row, &row.operands[i], value, pc as i32, rng);
            }
            None => text.push(c as char),
        }
    }
    Some(if rng.one_in(4) && !text.contains('\'') {
        text.to_ascii_uppercase().replace("0X", "0x").replace("0B", "0b")
    } else {
        text
    })
}

fn program(judge: Judge, rng: &mut Rng) -> (Source, usize) {
    let (chip, lines, head, tail) = judge.program();
    let chip = judge.chip(chip);
    let mut text = format!("; chip: {}\n{head}", chip.name);
    let (mut pc, mut written) = (0, 0);
    let rows = chip.isa.rows;
    while written < lines && pc + 3 < chip.flash_bytes / chip.word_bytes {
        let row = rng.below(rows.len() as u64) as usize;
        if (chip.isa.is_missing)(row) {
            continue;
        }
        if let Some(line) = instruction(judge, chip, &rows[row], pc, rng) {
            let _ = writeln!(text, "        {line}");
            pc += rows[row].len();
            written += 1;
        }
    }
    text += tail;
    (Source { judge, name: "random.asm".into(), text, chip, expected_codes: Vec::new() }, written)
}

#[test]
#[ignore = "needs as31, sdcc, gputils and binutils-avr: .ci/peers installs them"]
fn random_programs_give_the_bytes_of_their_assemblers() {
    let seed = random_seed();
    println!("seed {seed:#x}");
    let mut wrong = Vec::new();
    for judge in Judge::ALL {
        let mut rng = Rng::new(seed ^ judge as u64);
        let mut lines = 0;
        let dir = test_folder!(&format!("asm-random-{}", judge.name()));
        while lines < 30_000 {
            let (source, written) = program(judge, &mut rng);
            lines += written;
            std::fs::write(dir.join(&source.name), &source.text).expect("a source");
            let verdict = judge.assemble(&dir, &source.name, source.chip, &dir);
            // Remarks about instructions that change their own pointer (`ld r26, X+`) do not matter here.
            let said: Vec<_> = verdict.said.iter().filter(|line| !is_remark(line)).collect();
            assert!(said.is_empty(), "seed {seed:#x}: {}: {:#?}", judge.name(), &said[..said.len().min(20)]);
            let theirs = verdict.cells.expect("bytes");
            match ours::cells(&source) {
                Ok(ours) => {
                    let differ = differences(source.chip, &theirs, &ours);
                    if !differ.is_empty() {
                        let shown = differ[..differ.len().min(12)].join("\n  ");
                        wrong.push(format!("{}: {} bytes differ:\n  {shown}", judge.name(), differ.len()));
                    }
                }
                Err(faults) => wrong.push(format!("{}: refused:\n{faults}", judge.name())),
            }
        }
        println!("{}: {lines} instructions", judge.name());
    }
    assert!(wrong.is_empty(), "seed {seed:#x}:\n{}", wrong.join("\n"));
}

fn is_remark(line: &str) -> bool {
    line.ends_with("Assembler messages:") || line.ends_with("undefined combination of operands")
}
