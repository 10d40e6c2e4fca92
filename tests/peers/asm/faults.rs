//! Small sources that another assembler handles differently or incorrectly (faults.txt): its output, and
//! ours.
//!
//! Its output is checked too, so that a line is removed when that assembler is fixed.

use emu_test_support::case_lines;
use emu_test_support::test_folder;

use crate::corpus::Source;
use crate::judges::{Cells, Judge};
use crate::ours;

const LINES: &str = include_str!("faults.txt");

/// Returns the contiguous bytes from address 0; `-` for none.
fn shown(cells: &Cells, code: &str) -> String {
    let bytes: Vec<String> = (0..)
        .map_while(|addr| cells.iter().find(|((s, a), _)| *s == code && *a == addr))
        .map(|(_, b)| format!("{b:02x}"))
        .collect();
    if bytes.is_empty() { "-".to_owned() } else { bytes.concat() }
}

#[test]
#[ignore = "needs as31, sdcc, gputils and binutils-avr: .ci/peers installs them"]
fn faults_of_the_assemblers_are_as_listed() {
    let mut wrong = Vec::new();
    for line in case_lines(LINES) {
        let escaped = line.replace("\\|", "\u{1}");
        let columns: Vec<String> = escaped.split('|').map(|c| c.trim().replace('\u{1}', "|")).collect();
        let [judge, chip, source, why, theirs, ours] = columns.as_slice() else { panic!("six columns: {line}") };
        assert!(!why.is_empty(), "a reason is wanted: {line}");
        let judge = Judge::ALL.into_iter().find(|j| j.name() == judge).unwrap_or_else(|| panic!("{line}"));
        let chip = judge.chip(chip);
        let head = match judge {
            Judge::Sdas => "\t.area CSEG (ABS,CODE)\n".to_owned(),
            Judge::Gpasm => format!("\tlist p={}\n", chip.name),
            Judge::As31 | Judge::Avr => String::new(),
        };
        let tail = if judge == Judge::Gpasm { "\tend\n" } else { "" };
        let body: String = source.split(" / ").map(|l| format!("\t{}\n", l.trim())).collect();
        let source = Source {
            judge,
            name: "fault.asm".into(),
            text: format!("{head}{body}{tail}"),
            chip,
            expected_codes: Vec::new(),
        };
        let dir = test_folder!("asm-faults");
        std::fs::write(dir.join(&source.name), &source.text).expect("a source");
        let found = judge.assemble(&dir, &source.name, chip, &dir);
        let found = found.cells.map_or("-".to_owned(), |cells| shown(&cells, chip.code_space));
        if found != *theirs {
            wrong.push(format!("{line}: {} now makes {found}", judge.name()));
        }
        match ours::cells(&source) {
            Ok(cells) if shown(&cells, chip.code_space) == *ours => {}
            Ok(cells) => wrong.push(format!("{line}: ours is {}", shown(&cells, chip.code_space))),
            Err(faults) => wrong.push(format!("{line}: refused:\n{faults}")),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
