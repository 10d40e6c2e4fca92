//! Historic faults of other compilers: a correct compiler makes an image with the same fault from a different
//! program, and a check with default options finds it. The program's own image agrees.

#[path = "../../tests/ladder/parse.rs"]
mod common;

use emu_check::{CheckOptions, check, check_compiled};
use emu_test_support::case_lines;
use ladder::LadderProgram;

/// A program with the rungs of one column of the table.
fn program(name: &str, column: &str) -> LadderProgram {
    let (head, rungs) = match column.strip_prefix("#5") {
        Some(rungs) => ("LDmicro0.2", rungs),
        None => ("LDmicro0.1", column),
    };
    let rungs: String = rungs.split("||").map(rung).collect();
    common::parse(
        &format!("{name}.ld"),
        &format!("{head}\nCYCLE=1250\nCRYSTAL=11059200\nBAUD=9600\nIO LIST\nEND\nPROGRAM\n{rungs}"),
    )
}

fn rung(text: &str) -> String {
    let lines: String = text.split(';').map(|line| format!("{}\n", line.trim())).collect();
    format!("RUNG\n{lines}END\n")
}

/// Faults that a check with default options does not find.
const GAPS: &[&str] = &[];

#[test]
fn historic_faults_are_found() {
    let (mut rows, mut wrong) = (0, Vec::new());
    for row in case_lines(include_str!("kill_history.txt")) {
        // `||` separates rungs, ` | ` separates columns.
        let columns: Vec<&str> = row.split(" | ").map(str::trim).collect();
        let [id, what, chip, sound, faulty] = columns[..] else { panic!("five columns: {row}") };
        let (sound, faulty) = (program(id, sound), program(id, faulty));
        let options = CheckOptions { mcu: chip.to_owned(), ..CheckOptions::default() };
        let fail = |faults: Vec<diag::Diagnostic>| -> ! { panic!("{id}: {faults:?}") };
        let own = check(&sound, &options, &mut |_, _| {}).unwrap_or_else(|faults| fail(faults));
        assert!(own.agreed, "{id}: {}", own.text());
        let target = ladder_compile::CompileOptions { mcu: chip.to_owned(), ..Default::default() };
        let image = ladder_compile::compile(&faulty, &target).unwrap_or_else(|faults| fail(faults));
        let report = check_compiled(&sound, &image, &options, &mut |_, _| {}).unwrap_or_else(|faults| fail(faults));
        // A fault that is now found must be removed from the list of gaps.
        if report.agreed != GAPS.contains(&id) {
            wrong.push(format!("{id}: {what}: {}\n", if report.agreed { "not found" } else { "found" }));
        }
        rows += 1;
    }
    assert!(wrong.is_empty(), "{}", wrong.concat());
    assert!(rows >= 24, "{rows} rows");
}
