//! Initial inputs: files of tests and examples in the tree, and inputs made from its tables and machines.

use std::fs;
use std::path::Path;

use emu_core::chip::ChipFamily;
use emu_core::cpu::Cpu;
use emu_debug::snapshot::{self, SnapshotHeader};

use crate::machines::{FAMILIES, MachineVisitor, assemble, family_chip, family_program, visit_machine};
use crate::text_seeds::words;
use crate::workspace_root;

/// A source of seeds.
pub enum SeedSource {
    /// The files in a folder of the tree, including subfolders, whose names have this ending.
    Files(&'static str, &'static str),
    /// A function that makes the seeds.
    Generated(fn() -> Vec<Vec<u8>>),
}

impl SeedSource {
    /// The seeds, always in the same order.
    pub fn collect(&self) -> Vec<Vec<u8>> {
        match self {
            SeedSource::Generated(make) => make(),
            SeedSource::Files(folder, ending) => {
                let mut files = Vec::new();
                collect_files(&workspace_root().join(folder), ending, &mut files);
                files.sort();
                files.into_iter().map(|(_, bytes)| bytes).collect()
            }
        }
    }
}

/// Collects name and contents of all files in a folder and its subfolders whose names have this ending.
pub(crate) fn collect_files(folder: &Path, ending: &str, out: &mut Vec<(String, Vec<u8>)>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let name = path.display().to_string();
        if path.is_dir() {
            collect_files(&path, ending, out);
        } else if name.ends_with(ending)
            && let Ok(bytes) = fs::read(&path)
        {
            out.push((name, bytes));
        }
    }
}

/// A dictionary without words.
pub(crate) fn no_words() -> Vec<String> {
    Vec::new()
}

/// The cases of the assembler's tests for the chips of a family: `--- chip name`, followed by the source up
/// to the expected result.
fn assembler_cases(family: ChipFamily) -> Vec<Vec<u8>> {
    let mut files = Vec::new();
    collect_files(&workspace_root().join("emu-asm/tests/cases"), ".txt", &mut files);
    files.sort();
    let text: Vec<String> = files.iter().map(|(_, bytes)| String::from_utf8_lossy(bytes).into_owned()).collect();
    let cases = text.iter().flat_map(|text| text.split("\n--- ").skip(1)).filter_map(|case| {
        let (head, body) = case.split_once('\n')?;
        let name = head.split(' ').next()?;
        let own = [
            emu_avr::chips::chip(name),
            emu_8051::chips::chip(name),
            emu_pic16::chips::chip(name),
            emu_ap101::chips::chips().find(|chip| chip.name == name),
        ];
        own.into_iter().flatten().find(|chip| chip.family == family)?;
        let source = body.lines().take_while(|line| !line.starts_with("= ") && !line.starts_with("! "));
        Some(source.collect::<Vec<_>>().join("\n").into_bytes())
    });
    cases.chain([family_program(family).as_bytes().to_vec()]).collect()
}

/// Mnemonics, directives, registers, and words that open a block.
fn assembler_words(family: ChipFamily) -> Vec<String> {
    let chip = family_chip(family);
    let mnemonics = chip.isa.rows.iter().map(|row| format!(" {} ", row.mnemonic));
    let directives =
        emu_asm::directive_names(chip).into_iter().flat_map(|name| [format!(" {name} "), format!(" .{name} ")]);
    let registers = chip.regs.iter().chain(chip.bits).map(|reg| reg.name.to_owned());
    let pieces = words(&[
        "#define a a b\n",
        "m macro x\n",
        " endm\n",
        " rept 3\n",
        " include \"a\"\n",
        "x equ x+1\n",
        "\\@",
        "$",
    ]);
    mnemonics.chain(directives).chain(registers).chain(pieces).collect()
}

/// Every row of the instruction table with its operand bits all 0 and all 1.
fn instruction_rows(family: ChipFamily) -> Vec<Vec<u8>> {
    let chip = family_chip(family);
    let size = chip.word_bytes as usize;
    let words = |bits: u32, row: &emu_core::table::InstructionRow| -> Vec<u8> {
        let words = emu_core::table::instruction_words(row, chip.isa.word_bits, bits);
        let bytes = words.iter().flat_map(|word| word.to_le_bytes().into_iter().take(size).collect::<Vec<u8>>());
        [0, 1].into_iter().chain(bytes).collect()
    };
    chip.isa
        .rows
        .iter()
        .flat_map(|row| [words(row.pattern.value, row), words(row.pattern.value | !row.pattern.mask, row)])
        .collect()
}

/// Programs after the bytes of some pin edges.
fn code_programs(family: ChipFamily) -> Vec<Vec<u8>> {
    let chip = family_chip(family);
    let edges = (0..24).map(|n| n * 7);
    let all = assembler_cases(family).into_iter().filter_map(|source| {
        let image = emu_asm::assemble_text(chip, &String::from_utf8(source).ok()?).ok()?;
        let bytes: Vec<u8> = image.bytes_in(chip.code_space).map(|one| one.byte).take(2048).collect();
        (!bytes.is_empty()).then(|| edges.clone().chain(bytes).collect())
    });
    all.collect()
}

struct StateCollector;

impl MachineVisitor for StateCollector {
    type Output = Vec<Vec<u8>>;

    fn visit<C: Cpu + 'static>(self, mut cpu: C) -> Self::Output {
        let at = |cycle| {
            cpu.run(cycle, &mut ());
            cpu.save()
        };
        [0, 100, 5_000, 100_000].map(at).to_vec()
    }
}

fn machine_states(family: ChipFamily) -> Vec<Vec<u8>> {
    let chip = family_chip(family);
    visit_machine(chip, &assemble(chip, family_program(family)), StateCollector)
}

/// Snapshot files.
pub(crate) fn snapshot_files() -> Vec<Vec<u8>> {
    let file = |family: ChipFamily, state: Vec<u8>| {
        let head = SnapshotHeader {
            chip: family_chip(family).name.to_owned(),
            program: 7,
            options: "16 MHz".to_owned(),
            cycle: 9,
        };
        snapshot::encode_snapshot(&head, &state)
    };
    FAMILIES
        .into_iter()
        .flat_map(|family| machine_states(family).into_iter().map(move |state| file(family, state)))
        .collect()
}

/// Defines one function per family, as the target table needs them.
macro_rules! for_each_family {
    ($($of:ident -> $out:ty: $avr:ident $mcs51:ident $pic16:ident $ap101:ident;)*) => {$(
        #[doc = concat!("`", stringify!($of), "` of AVR.")]
        pub(crate) fn $avr() -> $out { $of(ChipFamily::Avr) }
        #[doc = concat!("`", stringify!($of), "` of the 8051.")]
        pub(crate) fn $mcs51() -> $out { $of(ChipFamily::Mcs51) }
        #[doc = concat!("`", stringify!($of), "` of the PIC16.")]
        pub(crate) fn $pic16() -> $out { $of(ChipFamily::Pic16) }
        #[doc = concat!("`", stringify!($of), "` of AP101.")]
        pub(crate) fn $ap101() -> $out { $of(ChipFamily::Ap101) }
    )*};
}

for_each_family! {
    assembler_cases  -> Vec<Vec<u8>>: cases_avr cases_8051 cases_pic16 cases_ap101;
    assembler_words    -> Vec<String>:  asm_avr asm_8051 asm_pic16 asm_ap101;
    instruction_rows   -> Vec<Vec<u8>>: words_avr words_8051 words_pic16 words_ap101;
    code_programs  -> Vec<Vec<u8>>: code_avr code_8051 code_pic16 code_ap101;
    machine_states -> Vec<Vec<u8>>: state_avr state_8051 state_pic16 state_ap101;
}

#[cfg(test)]
mod tests {
    use emu_debug::debug::DebugSession;

    use super::*;

    #[test]
    fn every_target_has_seeds_that_fit() {
        for target in crate::TARGETS {
            let seeds: Vec<Vec<u8>> = target.seeds.iter().flat_map(SeedSource::collect).collect();
            assert!(!seeds.is_empty(), "{} has no seeds", target.name);
            assert!(
                seeds.iter().any(|seed| seed.len() <= target.max_input_bytes),
                "{}: all seeds are too long",
                target.name
            );
        }
    }

    #[test]
    fn programs_are_accepted() {
        for family in FAMILIES {
            let image = emu_asm::assemble_text(family_chip(family), family_program(family));
            assert!(image.is_ok(), "{family:?}: {image:?}");
            let session: DebugSession = crate::machines::open_session(family_chip(family), image.unwrap_or_default());
            assert_eq!(session.machine().chip().family, family);
        }
    }
}
