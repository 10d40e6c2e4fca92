//! Compares length in bytes and machine cycles of every opcode with an independent table.

use emu_8051::isa::find_row;
use emu_core::rng::Rng;
use emu_core::{Cpu, ProgramError, StopReason};

use super::rig::TestBench;

/// Bytes and cycles by opcode, in sixteen columns by the low digit, typed from the manual's "Instruction
/// opcodes in hexadecimal order". Columns 8 to F are equal, and so are 6 and 7; they are given once.
///
/// Peers that count differently: jarikomppa/emu8051 (94 opcodes: two cycles are counted as one, MUL and DIV
/// as three), martinribelotta/mcs51_emulator (65: bytes instead of cycles), emu8051-stc (12: ALU with a
/// direct byte as two).
#[rustfmt::skip]
const TABLE: &str = "
    0_  1/1 2/2 3/2 1/1 1/1 2/1 1/1 1/1
    1_  3/2 2/2 3/2 1/1 1/1 2/1 1/1 1/1
    2_  3/2 2/2 1/2 1/1 2/1 2/1 1/1 1/1
    3_  3/2 2/2 1/2 1/1 2/1 2/1 1/1 1/1
    4_  2/2 2/2 2/1 3/2 2/1 2/1 1/1 1/1
    5_  2/2 2/2 2/1 3/2 2/1 2/1 1/1 1/1
    6_  2/2 2/2 2/1 3/2 2/1 2/1 1/1 1/1
    7_  2/2 2/2 2/2 1/2 2/1 3/2 2/1 2/1
    8_  2/2 2/2 2/2 1/2 1/4 3/2 2/2 2/2
    9_  3/2 2/2 2/2 1/2 2/1 2/1 1/1 1/1
    A_  2/2 2/2 2/1 1/2 1/4 -   2/2 2/2
    B_  2/2 2/2 2/1 1/1 3/2 3/2 3/2 3/2
    C_  2/2 2/2 2/1 1/1 1/1 2/1 1/1 1/1
    D_  2/2 2/2 2/1 1/1 1/1 3/2 1/1 2/2
    E_  1/2 2/2 1/2 1/2 1/1 2/1 1/1 1/1
    F_  1/2 2/2 1/2 1/2 1/1 2/1 1/1 1/1
";

/// Opcode, bytes and cycles of the 255 instructions.
fn table() -> Vec<(u8, u32, u64)> {
    let mut all = Vec::new();
    for line in TABLE.lines().filter(|line| !line.trim().is_empty()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let high = u8::from_str_radix(words[0].trim_end_matches('_'), 16).expect("a half byte");
        let columns = &words[1..];
        assert_eq!(columns.len(), 8, "{line}");
        for low in 0..16u8 {
            let column = match low {
                8.. => 7,
                6.. => 6,
                other => other,
            };
            if let Some((bytes, cycles)) = columns[usize::from(column)].split_once('/') {
                all.push((high << 4 | low, bytes.parse().expect("bytes"), cycles.parse().expect("cycles")));
            }
        }
    }
    all
}

#[test]
fn every_opcode_has_its_bytes_and_cycles() {
    let opcodes = table();
    assert_eq!(opcodes.len(), 255);
    let mut rng = Rng::new(0x5EED_0003);
    let mut bench = TestBench::new("nop");
    for (opcode, bytes, cycles) in opcodes {
        let row = find_row([opcode, 0, 0]).unwrap_or_else(|| panic!("{opcode:02x} has no row")).row;
        assert_eq!(row.len(), bytes, "{opcode:02x} {}", row.name);
        for n in 0..64 {
            // With distance 0 a relative target is the next instruction, whether the jump is taken or not.
            let relative = row.operands.last().is_some_and(|slot| slot.letter == b't' && !slot.kind.wide);
            let mut code = [opcode, rng.next_u64() as u8, rng.next_u64() as u8];
            // Direct addresses are in RAM or B, so that they neither stop the core nor disturb later
            // iterations.
            if bytes > 1 {
                code[1] = if n % 2 == 0 { 0x40 | code[1] & 0x3F } else { 0xF0 };
            }
            if bytes > 2 {
                code[2] = if n % 4 < 2 { 0x40 | code[2] & 0x3F } else { 0xF0 };
            }
            if relative {
                code[bytes as usize - 1] = 0;
            }
            for (addr, byte) in (TestBench::PC..).zip(code) {
                bench.put("code", addr, byte);
            }
            for addr in 0..0x100 {
                bench.put("idata", addr, rng.next_u64() as u8);
            }
            for name in ["ACC", "B", "PSW", "DPTR"] {
                bench.cpu.set_reg(name, rng.next_u64() as u32);
            }
            bench.cpu.set_reg("SP", 0x60);
            bench.cpu.set_pc(TestBench::PC);
            let (before, counted) = (bench.cpu.cycle(), bench.cpu.instructions());
            let stop = bench.cpu.step(&mut ());
            assert!(matches!(stop, StopReason::Limit | StopReason::Halted), "{code:02x?}: {stop:?}");
            assert_eq!(bench.cpu.cycle() - before, cycles, "{code:02x?} {}: cycles", row.name);
            assert_eq!(bench.cpu.instructions() - counted, 1, "{code:02x?}");
            let called =
                |bench: &TestBench| u32::from(bench.get("idata", 0x62)) << 8 | u32::from(bench.get("idata", 0x61));
            match row.mnemonic {
                "acall" | "lcall" => assert_eq!(called(&bench), TestBench::PC + bytes, "{code:02x?}: bytes"),
                "ajmp" | "ljmp" | "ret" | "reti" | "jmp" => {}
                _ => assert_eq!(bench.cpu.pc(), TestBench::PC + bytes, "{code:02x?} {}: bytes", row.name),
            }
        }
    }
}

#[test]
fn a5_stops_and_is_not_executed() {
    let mut bench = TestBench::new("nop");
    bench.put("code", TestBench::PC, 0xA5);
    bench.cpu.set_pc(TestBench::PC);
    let before = (bench.cpu.cycle(), bench.cpu.instructions());
    for _ in 0..2 {
        assert_eq!(bench.cpu.step(&mut ()), StopReason::Error(ProgramError::Illegal { pc: TestBench::PC, word: 0xA5 }));
        assert_eq!((bench.cpu.cycle(), bench.cpu.instructions(), bench.cpu.pc()), (before.0, before.1, TestBench::PC));
    }
}
