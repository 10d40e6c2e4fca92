//! Grids of CSLadder: errors, paths, identity of what is written, damaged text.

use ladder::grid::{self, ParsedGridProgram, paths_text, read, write};
use proptest::prelude::*;

fn examples() -> Vec<(String, String)> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let files = std::fs::read_dir(folder).expect("the examples").flatten().map(|entry| entry.path());
    let grids = files.filter(|path| path.extension().is_some_and(|extension| extension == "grid"));
    grids.map(|path| (path.display().to_string(), std::fs::read_to_string(&path).expect("text"))).collect()
}

/// The codes and places of the errors of grids under the head line.
fn faults(grids: &str) -> Vec<String> {
    let text = format!("CSLADDER\n{grids}");
    let faults = read("test.grid", &text).expect_err("an error");
    faults.iter().map(|fault| format!("{} {}:{}", fault.code, fault.pos.line, fault.pos.column)).collect()
}

#[test]
fn faults_have_a_code_and_a_place() {
    for (text, expected) in [
        ("EN0 - OTE:S8\n", "GR002 2:1"),
        ("GRID\nEN0 - XYZ:S8\nEND\n", "GR003 3:7"),
        ("GRID\nQ0 - OTE:S8\nEND\n", "GR003 3:1"),
        ("GRID\nEN0 EN1 OTE:S8\nEND\n", "GR004 3:5"),
        ("GRID\n- - OTE:S8\nEND\n", "GR004 3:1"),
        ("GRID\nEN0 - EN1\nEND\n", "GR004 3:7"),
        ("GRID\nOTE:S8 - OTE:S9\nEND\n", "GR004 3:1"),
        ("GRID\nEN8 - OTE:S8\nEND\n", "GR005 3:1"),
        ("GRID\nEN0 - OTE:S14\nEND\n", "GR005 3:7"),
        ("GRID\nEN0 - OTE:T0\nEND\n", "GR005 3:7"),
        ("GRID\nEN0 - TON:T0\nEND\n", "GR006 3:7"),
        ("GRID\nEN0 - TON:T0:0\nEND\n", "GR006 3:7"),
        ("GRID\nEN0 - CTU:C0:40000\nEND\n", "GR006 3:7"),
        ("GRID\nEN0 . OTE:S8\nEND\n", "GR007 3:7"),
        ("GRID\nEN0 | OTE:S8\nEND\n", "GR007 3:7"),
        ("GRID\nEN0 - OTE:S8\n", "GR010 2:1"),
        ("GRID\nEN0 - RES:C0\nEND\n", "GR101 3:7 GR105 1:1"),
        ("GRID\nEN0 - TON:T0:1\nEND\nGRID\nEN0 - TON:T0:1\nEND\n", "GR102 6:7 GR105 1:1"),
        ("GRID\nEN0 - CTU:C0:1\nEND\nGRID\nEN0 - CTU:C0:1\nEND\n", "GR103 6:7 GR105 1:1"),
        ("GRID\nS9 - OTE:S8\nEND\n", "GR104 3:1 GR105 1:1"),
        ("GRID\n/T3 - OTE:S8\nEND\n", "GR104 3:1 GR105 1:1"),
    ] {
        assert_eq!(faults(text).join(" "), expected, "{text}");
    }
}

/// Figure 36: the number of errors of the four checks.
#[test]
fn errors_of_the_four_checks_are_counted() {
    let text = "CSLADDER\nGRID\nT3 - RES:C1\nEND\nGRID\n/S9 - OTE:S8\nEND\n";
    let faults = read("test.grid", text).expect_err("errors");
    assert!(faults.last().is_some_and(|note| note.cause.contains("find 3 errors")), "{faults:?}");
}

/// A grid without an output is no error, but its reader says so.
#[test]
fn a_grid_without_output_gets_a_note() {
    let text = "CSLADDER\nGRID\nEN0 - OTE:S8\nEND\nGRID\nEN1 - .\nEND\n";
    let notes = read("test.grid", text).unwrap_or_else(|faults| panic!("{faults:?}")).notes;
    let notes: Vec<String> = notes.iter().map(|note| format!("{} {}", note.code, note.pos.line)).collect();
    assert_eq!(notes, ["GR009 5"]);
    let read = ladder::read_program("test.grid", text.as_bytes(), ladder::ReadOptions::default());
    let warnings = read.unwrap_or_else(|faults| panic!("{faults:?}")).warnings;
    assert!(warnings.iter().any(|note| note.code == "GR009"), "{warnings:?}");
}

/// The width of a grid whose last column is empty comes back.
#[test]
fn an_empty_last_column_is_written() {
    for rows in ["EN0 - .", "EN0 - . - .", ". - EN0 - .", "EN0 - .\n. - ."] {
        let text = format!("CSLADDER\nGRID\n{rows}\nEND\n");
        let grids = read("test.grid", &text).unwrap_or_else(|faults| panic!("{faults:?}")).program;
        let again = read("test.grid", &write(&grids)).unwrap_or_else(|faults| panic!("{rows}: {faults:?}")).program;
        let widths = |grids: &grid::GridProgram| grids.grids[0].rows.iter().map(Vec::len).collect::<Vec<_>>();
        assert_eq!(widths(&again), widths(&grids), "{rows}");
    }
}

/// Table 4: the paths of the grid of figure 37.
#[test]
fn paths_are_an_or_of_ands() {
    let text = "CSLADDER\nGRID\n  EN0 - F1 - --- - --- + OTL:S8\n  EN2 + /EN3 - --- - --- +\n  EN4 +\n  S8 +\nEND\nGRID\n  EN5 - OTE:F1\nEND\n";
    let grids = read("test.grid", text).unwrap_or_else(|faults| panic!("{faults:?}")).program;
    let first = "grid 1\n  (EN0 AND F1)\n  OR (EN2 AND /EN3)\n  OR (EN4 AND /EN3)\n  OR (S8 AND /EN3)\n  OTL S8\n";
    assert!(paths_text(&grids).starts_with(first), "{}", paths_text(&grids));
}

/// Two outputs of one grid, with links that keep neighbours apart.
#[test]
fn larger_grids_have_several_outputs() {
    let text = "CSLADDER\nGRID\n  EN0 ┬ EN1 ─ OTE:S8\n  EN2 ┘ .   . .\n  EN3 - --- - OTE:S9\nEND\n";
    let grids = read("test.grid", text).unwrap_or_else(|faults| panic!("{faults:?}")).program;
    let paths = "grid 1\n  (EN0 AND EN1)\n  OR (EN2 AND EN1)\n  OTE S8\n  (EN3)\n  OTE S9\n";
    assert_eq!(paths_text(&grids), paths);
}

#[test]
fn active_low_inputs_are_read_as_their_complement() {
    let text = "CSLADDER\nINPUTS ACTIVE-LOW\nGRID\n  EN0 - /EN1 - OTE:S8\nEND\n";
    let grids = read("test.grid", text).unwrap_or_else(|faults| panic!("{faults:?}")).program;
    let instructions = ladder::il::write(&grid::to_instruction_list(&grids));
    assert!(instructions.contains("LDN EN0\n    AND EN1\n"), "{instructions}");
    assert_eq!(write(&grids), text);
}

#[test]
fn too_many_paths_are_refused() {
    let columns = 2 * 11;
    let row = |links: &str| (0..columns / 2).map(|_| format!("EN0 {links} ")).collect::<String>();
    let other = (0..columns / 2).map(|_| "EN1 + ").collect::<String>();
    let text = format!("GRID\n{}OTE:S8\n{other}\nEND\n", row("+"));
    assert_eq!(faults(&text), [format!("GR008 3:{}", 6 * columns / 2 + 1)]);
}

#[test]
fn what_is_written_is_read_back() {
    let examples = examples();
    assert!(examples.len() >= 5);
    for (name, text) in examples {
        let grids = read(&name, &text).unwrap_or_else(|faults| panic!("{faults:?}")).program;
        let written = write(&grids);
        let again = read(&name, &written).unwrap_or_else(|faults| panic!("{faults:?}")).program;
        assert_eq!(write(&again), written, "{name}");
        assert_eq!(paths_text(&again), paths_text(&grids), "{name}");
        // Instructions are the same when they are read as text.
        let program = grid::to_instruction_list(&grids);
        let instructions = ladder::il::write(&program);
        let read = ladder::il::read(&name, &instructions).unwrap_or_else(|faults| panic!("{faults:?}\n{instructions}"));
        assert_eq!(read.program.without_positions(), program.without_positions(), "{name}");
    }
}

proptest! {
    /// Cells at random places: an error or a program, never a panic, and what is written is read back.
    #[test]
    fn random_grids_are_read_or_refused(cells in proptest::collection::vec(
        proptest::sample::select(vec!["EN0", "/EN1", "S8", "---", "-", "+", "|", "┬", "└", ".", "OTE:S8", "TON:T0:1.5", "RES:T0", "\n", "\nEND\nGRID\n"]), 0..60)) {
        let text = format!("CSLADDER\nGRID\n{}\nEND\n", cells.join(" "));
        if let Ok(ParsedGridProgram { program: grids, .. }) = read("random.grid", &text) {
            let written = write(&grids);
            let again = read("random.grid", &written).expect("it comes back").program;
            prop_assert_eq!(write(&again), written);
            prop_assert_eq!(paths_text(&again), paths_text(&grids));
        }
    }

    /// Examples with a piece cut out or doubled.
    #[test]
    fn damaged_text_never_panics(number in 0..5_usize, from in 0..800_usize, length in 0..40_usize, is_doubled: bool) {
        let (_, text) = &examples()[number];
        let characters: Vec<char> = text.chars().collect();
        let (from, to) = (from.min(characters.len()), (from + length).min(characters.len()));
        let piece = if is_doubled { &characters[from..to] } else { &[] };
        let damaged: String = characters[..from].iter().chain(piece).chain(piece).chain(&characters[to..]).collect();
        _ = read("damaged.grid", &damaged);
    }
}
