//! The assembler gives the same words and configuration for the programs of these tests as the naive one.

use emu_ap101::chips::AP101;
use emu_core::image::Image;
use emu_core::rng::Rng;

use super::asm::assemble;
use super::config::{BLOCK, Config, LENGTH};
use super::core::Core;
use super::page;
use super::programs;
use super::random::{compare, driven};
use super::tally::Tally;

/// The bytes of an image, in the form that the naive model takes.
fn bytes(image: &Image) -> Vec<Option<u8>> {
    let mut bytes = vec![None; BLOCK + LENGTH];
    for segment in &image.segments {
        let start = if segment.space == "code" { 0 } else { BLOCK };
        for (at, byte) in segment.bytes.iter().enumerate() {
            bytes[start + segment.addr as usize + at] = Some(*byte);
        }
    }
    bytes
}

fn config(bytes: &[Option<u8>]) -> Option<Config> {
    let block: Vec<u8> = bytes[BLOCK..BLOCK + LENGTH].iter().map(|byte| byte.unwrap_or(0)).collect();
    bytes[BLOCK].map(|_| Config::read(&block).expect("a good block"))
}

#[test]
fn programs_assemble_to_the_same_words_and_configuration() {
    let (mut faults, mut count, mut refused) = (Vec::new(), 0, 0);
    for case in programs::all().into_iter().chain(page::cases()) {
        count += 1;
        let wanted = assemble(&case.source);
        match emu_asm::assemble_text(&AP101, &case.source) {
            Ok(image) => {
                let got = bytes(&image);
                if wanted[..BLOCK] != got[..BLOCK] {
                    faults.push(format!("{}: other words\n{}", case.name, case.source));
                }
                if config(&wanted) != config(&got) {
                    faults.push(format!("{}: wanted {:?}\n got {:?}", case.name, config(&wanted), config(&got)));
                }
            }
            // What no machine has is refused there; the naive assembler makes words of it, to see what they
            // do.
            Err(errors) if errors.to_string().lines().all(|error| error.contains("ASM003: there is no ")) => {
                refused += 1
            }
            Err(errors) => faults.push(format!("{}: {errors}\n{}", case.name, case.source)),
        }
    }
    assert!(refused < 10, "{refused} of {count} refused");
    assert!(faults.is_empty(), "{} of {count}:\n{}", faults.len(), faults.join("\n"));
}

#[test]
fn the_examples_run_the_same_on_both() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples");
    let mut count = 0;
    for file in std::fs::read_dir(folder).expect("examples") {
        let path = file.expect("a file").path();
        if path.extension().is_none_or(|end| end != "asm") {
            continue;
        }
        let name = path.display().to_string();
        let source = std::fs::read_to_string(&path).expect("text");
        let bytes = bytes(&emu_asm::assemble_text(&AP101, &source).unwrap_or_else(|errors| panic!("{name}: {errors}")));
        for seed in 0..20 {
            let mut rng = Rng::new(seed);
            let plan = driven(&mut rng, bytes.clone(), config(&bytes), 2000);
            if let Err(fault) = compare::<Core>(&mut rng, &plan, &mut Tally::default(), &mut Vec::new()) {
                panic!("{name}, seed {seed}: {fault}");
            }
        }
        count += 1;
    }
    assert!(count > 5, "{count} examples");
}

/// A line, and the words that it assembles to.
const LINES: [(&str, &[u16]); 16] = [
    ("LD I1", &[0x0001]),
    ("LDC I511", &[0x11FF]),
    ("STO E0", &[0x2200]),
    ("STOC E255", &[0x32FF]),
    ("STC M1", &[0x4601]),
    ("RTC R127", &[0x547F]),
    ("AND R133", &[0x6485]),
    ("ANDC M300", &[0x772C]),
    ("OR I1,X", &[0x8801]),
    ("ORC E1,X", &[0x9A01]),
    ("XOR M1,X", &[0xAE01]),
    ("NOT", &[0xB000]),
    ("CLR", &[0xC000]),
    ("JMP 2047", &[0xD7FF]),
    ("NOP", &[0xFFFF]),
    ("TIM R1,#50", &[0x2501, 0xF032]),
];

#[test]
fn a_line_becomes_one_word_or_several() {
    for (line, words) in LINES {
        let got = emu_asm::assemble_line(&AP101, line, 0).unwrap_or_else(|error| panic!("{line}: {}", error.cause));
        assert_eq!(got, words, "{line}");
    }
}

#[test]
fn operands_are_spelt_as_the_reference_spells_them() {
    for (spelt, plain) in [("AND I₂", "AND I2"), ("STO E_1", "STO E1"), ("OR T4", "OR R4"), ("LD O2", "LD E2")] {
        let words = |line: &str| {
            emu_asm::assemble_line(&AP101, line, 0).unwrap_or_else(|error| panic!("{line}: {}", error.cause))
        };
        assert_eq!(words(spelt), words(plain), "{spelt}");
    }
    for refused in ["STC I1", "RTC I1", "STO O1", "LD I512", "LD M512", "FOO I1", "LD", "JMP 2048"] {
        assert!(emu_asm::assemble_line(&AP101, refused, 0).is_err(), "{refused}");
    }
}
