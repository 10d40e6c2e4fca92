//! Every bit operation on every bit of RAM, ACC, B and PSW, with every value of its byte and of CY, compared
//! with an implementation on lists of bits; and the parity of A.

use emu_core::Cpu;

use super::rig::{ACC, B, PSW, TestBench, parity};

/// The bits of the byte that contains the operand, and CY.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct State {
    bits: [bool; 8],
    /// Position of the operand bit.
    n: usize,
    cy: bool,
    jumps: bool,
}

fn written(s: State, value: bool) -> State {
    let mut after = s;
    after.bits[s.n] = value;
    after
}

fn carry(s: State, cy: bool) -> State {
    State { cy, ..s }
}

/// Template (b is the bit, t a target 20h after the instruction), cycles, reference.
type Operation = (&'static str, u64, fn(State) -> State);

#[rustfmt::skip]
const OPERATIONS: &[Operation] = &[
    ("clr b",    1, |s| written(s, false)),
    ("setb b",   1, |s| written(s, true)),
    ("cpl b",    1, |s| written(s, !s.bits[s.n])),
    ("anl C,b",  2, |s| carry(s, if s.bits[s.n] { s.cy } else { false })),
    ("anl C,/b", 2, |s| carry(s, if s.bits[s.n] { false } else { s.cy })),
    ("orl C,b",  2, |s| carry(s, if s.bits[s.n] { true } else { s.cy })),
    ("orl C,/b", 2, |s| carry(s, if s.bits[s.n] { s.cy } else { true })),
    ("mov C,b",  1, |s| carry(s, s.bits[s.n])),
    ("mov b,C",  2, |s| written(s, s.cy)),
    ("jb b,t",   2, |s| State { jumps: s.bits[s.n], ..s }),
    ("jnb b,t",  2, |s| State { jumps: !s.bits[s.n], ..s }),
    ("jbc b,t",  2, |s| State { jumps: s.bits[s.n], ..written(s, false) }),
    ("clr C",    1, |s| carry(s, false)),
    ("setb C",   1, |s| carry(s, true)),
    ("cpl C",    1, |s| carry(s, !s.cy)),
    ("jc t",     2, |s| State { jumps: s.cy, ..s }),
    ("jnc t",    2, |s| State { jumps: !s.cy, ..s }),
];

fn bits(byte: u8) -> [bool; 8] {
    std::array::from_fn(|n| byte >> n & 1 == 1)
}

fn byte(bits: [bool; 8]) -> u8 {
    (0..8).map(|n| u8::from(bits[n]) << n).sum()
}

/// The byte that contains bit `addr`.
fn home(addr: u32) -> (&'static str, u32) {
    if addr < 0x80 { ("idata", 0x20 + addr / 8) } else { ("sfr", addr / 8 * 8) }
}

fn check(operation: &Operation, addr: u32) {
    let (template, cycles, reference) = operation;
    let target = format!("0x{:04X}", TestBench::PC + 0x20);
    // Only operands are replaced, never letters of the mnemonic.
    let (name, operands) = template.split_once(' ').expect("an operand");
    let line = format!("{name} {}", operands.replace('b', &addr.to_string()).replace('t', &target));
    let mut bench = TestBench::new(&line);
    let (space, at) = home(addr);
    for (value, cy) in (0..=255u8).flat_map(|value| [false, true].map(|cy| (value, cy))) {
        let user = value.wrapping_mul(5) & 0x7E;
        // The value of A must differ from the byte of a bit in RAM or in B.
        let acc = if at == ACC { value } else { value.wrapping_mul(77).wrapping_add(u8::from(cy)) };
        bench.put("sfr", ACC, acc);
        bench.put("sfr", PSW, u8::from(cy) << 7 | user);
        bench.put(space, at, value);
        // In PSW, CY is bit 7 and P follows A; elsewhere PSW keeps its value.
        let psw = if at == PSW { value & 0xFE | parity(acc.into()) as u8 } else { u8::from(cy) << 7 | user };
        let held = if at == PSW { psw } else { value };
        let before = State { bits: bits(held), n: (addr % 8) as usize, cy: psw & 0x80 != 0, jumps: false };
        let spent = bench.go();
        let mut after = reference(before);
        if at == PSW {
            // CY is one of the bits: whichever of the two was written has the new value.
            let cy = if after.cy == before.cy { after.bits[7] } else { after.cy };
            after = State { cy, ..after };
            after.bits[7] = cy;
            after.bits[0] = parity(acc.into()) == 1;
        }
        let a = if at == ACC { byte(after.bits) } else { acc };
        let psw = if at == PSW { byte(after.bits) } else { u8::from(after.cy) << 7 | user };
        let wanted = (
            byte(after.bits),
            a,
            psw & 0xFE | parity(a.into()) as u8,
            if after.jumps { TestBench::PC + 0x20 } else { bench.next() },
            *cycles,
        );
        let found = (bench.get(space, at), bench.get("sfr", ACC), bench.get("sfr", PSW), bench.cpu.pc(), spent);
        assert_eq!(found, wanted, "{line}, {space}:{at:02x} = {value:02x}, CY {cy}: (byte, A, PSW, PC, cycles)");
    }
}

#[test]
fn every_bit_of_ram() {
    for operation in OPERATIONS {
        (0..0x80).for_each(|addr| check(operation, addr));
    }
}

#[test]
fn every_bit_of_a_b_and_psw() {
    for operation in OPERATIONS {
        for register in [ACC, B, PSW] {
            (register..register + 8).for_each(|addr| check(operation, addr));
        }
    }
}

/// P is the parity of A, for any value written to PSW and any way in which A got its value.
#[test]
fn p_is_the_parity_of_a() {
    let writes = ["mov 0xD0,#0x5A", "mov 0xD0,0x45", "pop 0xD0", "orl 0xD0,#1", "xrl 0xD0,#1", "anl 0xD0,#0xFE"];
    for line in writes.iter().chain(&["inc 0xD0", "dec 0xD0", "mov 0xD0,@R0", "setb 0xD0", "clr 0xD0", "cpl 0xD0"]) {
        let mut bench = TestBench::new(line);
        for (a, psw) in (0..=255u8).flat_map(|a| (0..=255u8).step_by(5).map(move |psw| (a, psw))) {
            bench.put("idata", 0x45, psw);
            bench.put("sfr", ACC, a);
            bench.put("sfr", PSW, psw);
            bench.go();
            assert_eq!(i32::from(bench.get("sfr", PSW) & 1), parity(a.into()), "{line}: A {a:02x}, PSW {psw:02x}");
        }
    }
    let mut bench = TestBench::new("mov A,0xD0");
    for (a, psw) in (0..=255u8).flat_map(|a| (0..=255u8).map(move |psw| (a, psw))) {
        bench.put("sfr", ACC, a);
        bench.put("sfr", PSW, psw);
        bench.go();
        let wanted = psw & 0xFE | parity(a.into()) as u8;
        assert_eq!(bench.get("sfr", ACC), wanted, "a program reads PSW: A {a:02x}, PSW {psw:02x}");
    }
}
