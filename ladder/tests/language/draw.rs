//! Tests the drawing with expected text and with the positions of the elements.

use ladder::{LadderProgram, draw, draw_rung, parse};

const GROUPS: &str = include_str!("draw/groups.ld");
const SYMBOLS: &str = include_str!("draw/symbols.ld");

fn program(text: &str) -> LadderProgram {
    parse("t", text).expect("reads").program
}

#[test]
fn drawings_are_as_kept() {
    let pairs = [(GROUPS, include_str!("draw/groups.txt")), (SYMBOLS, include_str!("draw/symbols.txt"))];
    for (text, expected) in pairs {
        let found = draw(&program(text));
        assert!(found == expected, "found:\n{found}");
    }
}

#[test]
fn all_lines_are_of_one_width() {
    for text in [GROUPS, SYMBOLS] {
        let found = draw(&program(text));
        let widths: Vec<usize> = found.lines().map(|l| l.chars().count()).collect();
        assert!(widths.iter().all(|w| Some(w) == widths.first()), "{found}");
    }
}

#[test]
fn elements_are_found_in_the_lines() {
    // Rung, then for each element in text order: the line of its symbol, and the symbol.
    let expected: [(usize, &[(usize, &str)]); 3] = [
        (
            0,
            &[
                (0, "Groups at the left rail, in the middle and at the right rail."),
                (2, "] ["),
                (5, "] ["),
                (2, "]/["),
                (2, "( )"),
                (5, "[TON 2.000 s]"),
                (5, "( )"),
            ],
        ),
        (2, &[(1, "[  0  ]"), (1, "( )"), (4, "{ 1 MOV }"), (7, "( )")]),
        (3, &[(1, "] ["), (4, "+------+"), (7, "] ["), (1, "{CTC 0:3}")]),
    ];
    let program = program(GROUPS);
    for (rung, symbols) in expected {
        let drawing = draw_rung(&program, rung);
        let found: Vec<(usize, String)> = drawing
            .elements
            .iter()
            .map(|c| (c.line, drawing.lines[c.line].chars().skip(c.column).take(c.width).collect()))
            .collect();
        let expected: Vec<(usize, String)> = symbols.iter().map(|(l, s)| (*l, (*s).to_owned())).collect();
        assert_eq!(found, expected, "rung {}", rung + 1);
        let ids: Vec<u32> = drawing.elements.iter().map(|c| c.id.index).collect();
        assert_eq!(ids, (0..symbols.len() as u32).collect::<Vec<_>>());
    }
    assert!(draw_rung(&program, 4).lines.is_empty());
}

#[test]
fn an_empty_program_is_its_end() {
    let text = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nPROGRAM\n";
    assert_eq!(draw(&program(text)), format!("      ||------[END]{}||\n", "-".repeat(49)));
}

#[test]
fn what_is_too_large_is_said() {
    let name = "a".repeat(126);
    let wide = format!("SERIES\n{}END\n", format!("EQU {name} 1\n").repeat(5_000));
    let body = format!("RUNG\nPARALLEL\n{wide}{}END\nEND\n", "SHORT\n".repeat(5_000));
    let text = format!("LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nPROGRAM\n{body}");
    let drawing = draw_rung(&program(&text), 0);
    assert_eq!(drawing.lines.len(), 1);
    assert!(drawing.lines[0].contains("too large to draw"), "{}", drawing.lines[0]);
}
