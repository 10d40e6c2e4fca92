//! Counts set from outside: the resulting `value`, and Q and the count after the next program cycle.

use emu_ap101::Ap101;
use emu_core::Cpu;

use crate::rig::{Block, image, words};

/// Type, unit, preset.
type Record = (u8, u8, u16);
/// Count and Q.
type Found = (i16, u8);

/// A module; what is written to the module in each program cycle; the count that is set between the first two
/// program cycles; Q after that; count and Q after the second program cycle.
#[rustfmt::skip]
const CASES: &[(Record, [bool; 2], i16, u8, Found)] = &[
    // TON
    ((1, 0, 10), [true, true],       9, 0, (10, 0)),
    ((1, 0, 10), [true, true],      10, 1, (10, 1)),
    ((1, 0, 10), [true, true],  -32768, 0, (-32767, 0)),
    ((1, 0, 10), [false, false],    10, 0, (0, 0)),
    // TOF
    ((2, 0, 10), [false, false],     9, 1, (10, 1)),
    ((2, 0, 10), [false, false], 32767, 0, (32767, 0)),
    // RTO
    ((3, 0, 10), [true, false],     10, 1, (10, 1)),
    ((3, 0, 10), [true, true],      -1, 0, (0, 0)),
    // CTU, CTD, CTC
    ((5, 0, 10), [false, true],      9, 0, (10, 1)),
    ((5, 0, 10), [true, true],      32767, 1, (32767, 1)),
    ((5, 0, 10), [false, true],     32767, 1, (-32768, 0)),
    ((6, 0, 0xFFFF), [false, true],     0, 1, (-1, 1)),
    ((6, 0, 0xFFFF), [false, true],    -1, 1, (-2, 0)),
    ((7, 0, 10), [false, true],     10, 0, (0, 1)),
];

fn machine(module: Record) -> Ap101 {
    let mut block = Block { outputs: 0, period: 8, ..Block::EMPTY };
    block.modules[5] = module;
    block.programs[0] = [0, 2, 0, 1];
    Ap101::new(&image(&words("ld M0; sto R5; nop"), Some(&block)))
}

fn value(cpu: &Ap101) -> i16 {
    i16::from_le_bytes([10, 11].map(|addr| cpu.peek("value", addr).expect("a module")))
}

#[test]
fn a_count_is_what_it_was_set_to() {
    for &(module, [first, second], count, q, (then, then_q)) in CASES {
        let mut cpu = machine(module);
        assert!(cpu.poke("m", 0, first.into()));
        cpu.run(7, &mut ());
        for (addr, byte) in (10..).zip(count.to_le_bytes()) {
            assert!(cpu.poke("value", addr, byte), "{module:?}");
        }
        assert_eq!((value(&cpu), cpu.peek("r", 5)), (count, Some(q)), "{module:?} set to {count}");
        assert!(cpu.poke("m", 0, second.into()));
        cpu.run(15, &mut ());
        assert_eq!((value(&cpu), cpu.peek("r", 5)), (then, Some(then_q)), "{module:?} behind {count}");
    }
}

#[test]
fn time_cannot_be_set() {
    for (module, addr) in [((1, 1, 10), 10), ((4, 3, 10), 11), ((1, 0, 10), 12), ((1, 0, 10), 256)] {
        let mut cpu = machine(module);
        cpu.run(7, &mut ());
        assert!(!cpu.poke("value", addr, 1), "{module:?} {addr}");
        assert_eq!(value(&cpu), 0);
    }
}
