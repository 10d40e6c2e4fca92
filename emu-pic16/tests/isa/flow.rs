//! The program counter: pages, the end of memory, computed jumps, and the stack (DS33023, sections 6.2.2 to
//! 6.2.5).

use emu_core::rng::Rng;
use emu_core::{Cpu, Probe, StopReason};
use emu_pic16::Pic16Stack;

use super::rig::{TestBench, machine, machine_with, put_word, word};

/// CALL and GOTO to all targets with all values of PCLATH.
#[test]
fn calls_and_jumps_to_all_pages() {
    let mut bench = TestBench::new("nop");
    for target in (0..0x800u32).step_by(7).chain([0x7FF]) {
        for name in ["call", "goto"] {
            put_word(&mut bench.cpu, 0x1234, word(&format!("{name} {target}")));
            for pclath in 0..0x20u8 {
                bench.put(0x0A, pclath);
                let sp = bench.cpu.stack().next;
                assert_eq!(bench.go_from(0x1234), 2);
                let page = u32::from(pclath / 8) * 0x800;
                assert_eq!(bench.cpu.pc(), page + target, "{name} {target:03x} PCLATH={pclath:02x}");
                assert_eq!(bench.get(0x0A), pclath, "{name}: PCLATH");
                let Pic16Stack { entries: places, next } = bench.cpu.stack();
                match name {
                    "call" => assert_eq!((places[sp], next), (0x1235, (sp + 1) % 8), "{name} {target:03x}"),
                    _ => assert_eq!(next, sp),
                }
            }
        }
    }
}

/// Chips by their number of words: 16C71 and 16F84 1K, 628 2K, 873 4K, 877 8K.
const SIZES: &[(&str, u32)] =
    &[("pic16c71", 0x400), ("pic16f84", 0x400), ("pic16f628", 0x800), ("pic16f873", 0x1000), ("pic16f877", 0x2000)];

/// The counter has 13 bits on every chip; memory repeats above its end (6.2), and the counter goes from 1FFFh
/// to 0.
#[test]
fn memory_repeats_above_its_end() {
    for &(name, words) in SIZES {
        // MOVLW of a mix of the address bits, so that no two neighbours or mirrors are equal by chance.
        let program: Vec<u16> = (0..words).map(|at| 0x3000 | (at ^ at >> 5) as u16 & 0xFF).collect();
        let mut cpu = machine_with(name, 1, &program);
        for pc in 0..0x2000u32 {
            cpu.set_pc(pc);
            assert_eq!(cpu.step(&mut ()), StopReason::Limit);
            let at = pc % words;
            assert_eq!(cpu.reg("W"), Some((at ^ at >> 5) & 0xFF), "{name} at {pc:04x}");
            assert_eq!(cpu.pc(), (pc + 1) % 0x2000, "{name} at {pc:04x}");
        }
        assert_eq!(cpu.peek("flash", 2 * words), None, "{name}");
    }
}

/// A run over all 8,192 words and on, in one piece: the counter also wraps in the hot loop.
#[test]
fn a_run_goes_round() {
    for &(name, words) in SIZES {
        let mut cpu = machine_with(name, 1, &vec![word("nop"); words as usize]);
        put_word(&mut cpu, 5, word("incf 0x20, F"));
        assert!(cpu.poke("data", 0x20, 0));
        assert_eq!(cpu.run(3 * 0x2000 + 6, &mut ()), StopReason::Limit);
        assert_eq!((cpu.pc(), cpu.instructions()), (6, 3 * 0x2000 + 6), "{name}");
        let times = 3 * (0x2000 / words) + 1;
        assert_eq!(cpu.peek("data", 0x20), Some(times as u8), "{name}");
    }
}

/// CALL from the last word, and a skip over the end.
#[test]
fn the_last_word_of_memory() {
    for &(name, words) in SIZES {
        let mut cpu = machine(name, 1);
        put_word(&mut cpu, words - 1, word("call 0x010"));
        put_word(&mut cpu, 0x010, word("return"));
        cpu.set_pc(0x1FFF);
        assert_eq!(cpu.run(2, &mut ()), StopReason::Limit);
        assert_eq!((cpu.pc(), cpu.stack().entries[0]), (0x10, 0), "{name}");
        assert_eq!(cpu.run(4, &mut ()), StopReason::Limit);
        assert_eq!(cpu.pc(), 0, "{name}");
        put_word(&mut cpu, words - 1, word("btfsc 0x03, 0"));
        cpu.set_reg("STATUS", 0x18);
        cpu.set_pc(0x1FFF);
        assert_eq!(cpu.run(6, &mut ()), StopReason::Limit);
        assert_eq!((cpu.pc(), cpu.cycle()), (1, 6), "{name}");
    }
}

/// A computed jump uses all of PCLATH; a table that crosses a 256-word boundary jumps to the wrong place
/// without it.
#[test]
fn computed_jumps_cross_pages() {
    let mut rng = Rng::new(0x5EED_1603);
    let mut bench = TestBench::new("nop");
    let [jump, write] = ["addwf 0x02, F", "movwf 0x02"].map(word);
    for _ in 0..20_000 {
        let pc = rng.below(0x2000) as u32;
        let (pclath, w) = (rng.below(0x20) as u8, rng.next_u64() as u8);
        let add = rng.one_in(2);
        put_word(&mut bench.cpu, pc, if add { jump } else { write });
        bench.put(0x0A, pclath);
        bench.set_w(w);
        assert_eq!(bench.go_from(pc), 2);
        let low = if add { ((pc + 1) % 256 + u32::from(w)) % 256 } else { w.into() };
        assert_eq!(bench.cpu.pc(), u32::from(pclath) * 256 + low, "PC={pc:04x} PCLATH={pclath:02x} W={w:02x}");
    }
}

/// Random calls and returns compared with a list in which the oldest of nine entries is lost.
#[test]
fn the_stack_goes_round() {
    let seed = 0x5EED_1604;
    let mut rng = Rng::new(seed);
    let mut bench = TestBench::new("nop");
    let lines = ["call 0x000", "return", "retlw 0x12", "retfie"].map(word);
    // Content of the eight entries, and the position of the pointer; calls and returns need not balance.
    let (mut places, mut depth) = ([0u32; 8], 0i64);
    for n in 0..20_000 {
        let pc = rng.below(0x2000) as u32;
        let way = if rng.below(100) < 50 + 30 * (n / 1000 % 3) - 30 { 0 } else { 1 + rng.below(3) as usize };
        put_word(&mut bench.cpu, pc, lines[way]);
        assert_eq!(bench.go_from(pc), 2);
        if way == 0 {
            places[depth.rem_euclid(8) as usize] = (pc + 1) % 0x2000;
            depth += 1;
        } else {
            depth -= 1;
            let wanted = places[depth.rem_euclid(8) as usize];
            assert_eq!(bench.cpu.pc(), wanted, "seed {seed:x}, {n}: depth {depth}");
            bench.put(0x0B, 0);
        }
    }
}

/// Probe that counts the instructions it is shown.
#[derive(Default)]
struct Shown(u64);

impl Probe for Shown {
    const INSN: bool = true;
    fn on_instruction(&mut self, _: u64, _: u32) -> bool {
        self.0 += 1;
        false
    }
}

/// The counter reaches the breakpoint by wrapping at 1FFFh: its instruction is shown once, when it is
/// executed.
#[test]
fn a_trap_at_0_after_the_end() {
    let mut cpu = machine_with("pic16f877", 1, &[word("nop"); 0x2000]);
    cpu.set_breakpoint(0, true);
    cpu.set_pc(0x1FFE);
    let mut shown = Shown::default();
    assert_eq!(cpu.run(10, &mut shown), StopReason::Breakpoint { pc: 0 });
    assert_eq!((cpu.cycle(), cpu.instructions(), shown.0), (2, 2, 2));
    assert_eq!(cpu.run(10, &mut shown), StopReason::Limit);
    assert_eq!((cpu.cycle(), cpu.instructions(), shown.0), (10, 10, 10));
}

/// A breakpoint stops a run at every iteration of a jump to itself, with any probe.
#[test]
fn a_trap_at_a_jump_to_itself() {
    let mut cpu = machine_with("pic16f877", 1, &[word("goto 0x000")]);
    // An event must be pending, otherwise the machine is halted.
    cpu.drive(emu_core::CycleTime::at(500), 0, emu_core::PinLevel::High);
    cpu.set_breakpoint(0, true);
    let mut shown = cpu.clone();
    for turn in 0..20 {
        assert_eq!(shown.run(100, &mut Shown::default()), StopReason::Breakpoint { pc: 0 });
        assert_eq!(cpu.run(100, &mut ()), StopReason::Breakpoint { pc: 0 });
        assert_eq!((cpu.cycle(), shown.cycle()), (2 * turn, 2 * turn));
    }
}
