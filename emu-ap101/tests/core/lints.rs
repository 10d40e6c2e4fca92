//! The lints of suspicious instructions.

use emu_ap101::Ap101;
use emu_core::cpu::{Cpu, Probe};
use emu_core::lint::Lint;

use crate::rig::{Block, image, words};

#[derive(Default)]
struct Reported(Vec<String>);

impl Probe for Reported {
    const LINT: bool = true;
    fn on_lint(&mut self, _: u64, pc: u32, lint: Lint) {
        assert!(!lint.hint().is_empty());
        self.0.push(format!("{pc} {}: {lint}", lint.code()));
    }
}

/// Whether inputs are live; program; lints of one program cycle.
const CASES: &[(bool, &str, &[&str])] = &[
    (false, "ld I1; sto E1; ld M300; ld R1; sto R129; not; clr; nop; .word 0xF005", &[]),
    (
        false,
        "ld I8; sto I9",
        &[
            "0 LINT016: I8 is used, but the controller does not have it",
            "1 LINT016: I9 is used, but the controller does not have it",
        ],
    ),
    (false, "ld E4", &["0 LINT016: E4 is used, but the controller does not have it"]),
    (false, ".word 0x232C", &["0 LINT016: E300 is used, but the controller does not have it"]),
    (
        false,
        "ld R2; .word 0x0590",
        &[
            "0 LINT016: R2 is used, but the controller does not have it",
            "1 LINT016: R400 is used, but the controller does not have it",
        ],
    ),
    (false, "stc R2; ldc M0; stc R2", &["2 LINT016: R2 is used, but the controller does not have it"]),
    (false, "sto I1; stoc I1", &[]),
    (true, "sto I1; ldc M0; stoc I1", &["0 LINT017: the input I1 is written", "2 LINT017: the input I1 is written"]),
    (
        false,
        ".word 0x4001; ldc M0; .word 0x4001; .word 0x5001",
        &["2 LINT017: the input I1 is written", "3 LINT017: the input I1 is written"],
    ),
    (false, "sto R257; .word 0xF005", &[]),
    (false, "sto R257; nop", &["0 LINT018: the preset port of R1: no NOP with data follows"]),
    (
        false,
        "sto R257; .word 0xF805; sto R258",
        &[
            "0 LINT018: the preset port of R1: no NOP with data follows",
            "2 LINT016: R258 is used, but the controller does not have it",
        ],
    ),
    (false, "stoc R257; .word 0xF005", &["0 LINT018: the preset port of R1: only STO gives a preset"]),
    (false, "ld R257", &["0 LINT018: the preset port of R1: a port reads 0"]),
    (
        false,
        ".word 0xB001; .word 0xC800",
        &["0 LINT019: the operand field of 0xb001 is not 0", "1 LINT019: the operand field of 0xc800 is not 0"],
    ),
];

#[test]
fn lints_are_reported() {
    for &(live, program, wanted) in CASES {
        let mut block = Block { live, ..Block::EMPTY };
        block.modules[1] = (1, 1, 5);
        let program = words(program);
        let mut reported = Reported::default();
        let mut machine = Ap101::new(&image(&program, Some(&block)));
        machine.run(4 + program.len() as u64, &mut reported);
        assert_eq!(reported.0, wanted, "{program:04x?}");
        // A run without the probe does the same.
        let mut blind = Ap101::new(&image(&program, Some(&block)));
        blind.run(machine.cycle(), &mut ());
        for space in ["i", "e", "m", "r", "preset"] {
            let all = |machine: &Ap101| (0..256).map(|addr| machine.peek(space, addr)).collect::<Vec<_>>();
            assert_eq!(all(&blind), all(&machine), "{space}: {program:04x?}");
        }
    }
}
