//! Waiting loops in the style of compilers, and delays, are skipped: few instructions of a million cycles are
//! executed one by one.

use emu_8051::Mcs51;
use emu_avr::Avr;
use emu_core::cpu::{Cpu, Probe, RamInit};
use emu_pic16::Pic16;

/// A probe that counts the instructions that are executed one by one.
struct InstructionCounter(u64);

impl Probe for InstructionCounter {
    const INSN: bool = true;
    const EVERY_ITERATION: bool = false;

    fn on_instruction(&mut self, _: u64, _: u32) -> bool {
        self.0 += 1;
        false
    }
}

/// Machine cycles of a run.
const SPAN: u64 = 1_000_000;

/// Maximum number of instructions executed one by one in a run.
const MOST: u64 = 20_000;

/// Rows are `chip | what | program`. Timers run with their longest period, so that few events are due.
const PROGRAMS: &[(&str, &str, &str)] = &[
    ("atmega328p", "polls a flag", "w:\nsbis 0x16, 1\nrjmp w\nrjmp w"),
    ("atmega328p", "and clears the watchdog", "w:\nwdr\nsbis 0x16, 1\nrjmp w\nrjmp w"),
    (
        "atmega328p",
        "that is on",
        "ldi r18, 0x18\nsts 0x60, r18\nldi r18, 0x08\nsts 0x60, r18\nw:\nin r25, 0x16\nwdr\nsbrs r25, 1\nrjmp w\nrjmp w",
    ),
    ("atmega328p", "through Z", "w:\nldi r30, 0x36\nldi r31, 0\nld r16, Z\nsbrs r16, 4\nrjmp w\nrjmp w"),
    (
        "atmega328p",
        "as avr-gcc -O0",
        "w:\nnop\nldi r24, 0x36\nldi r25, 0\nmovw r30, r24\nld r24, Z\nmov r24, r24\nldi r25, 0\nandi r24, 2\nclr r25\n\
         or r24, r25\nbreq w\nrjmp w",
    ),
    ("atmega328p", "a delay of two bytes", "w:\nldi r24, 0xff\nldi r25, 0xff\nd:\nsbiw r24, 1\nbrne d\nrjmp w"),
    (
        "atmega328p",
        "a delay of three",
        "w:\nldi r18, 0\nldi r19, 0\nldi r20, 4\nd:\nsubi r18, 1\nsbci r19, 0\nsbci r20, 0\nbrne d\nrjmp w",
    ),
    ("pic16f877", "polls a flag", "w: btfss 0x0c, 2\ngoto w\ngoto w"),
    ("pic16f877", "and clears the watchdog", "w: clrwdt\nbtfss 0x0c, 2\ngoto w\ngoto w"),
    ("pic16f877", "that is on", " __config 0x3ff6\nw: clrwdt\nbtfss 0x0c, 2\ngoto w\ngoto w"),
    ("pic16f877", "and chooses its bank", "w: bcf 3, 5\nbcf 3, 6\nbtfss 0x0c, 2\ngoto w\ngoto w"),
    ("pic16f877", "two banks", "w: bsf 3, 5\nmovf 6, w\nbcf 3, 5\nxorwf 6, w\nbtfsc 3, 2\ngoto w\ngoto w"),
    (
        "pic16f877",
        "a delay",
        "w: movlw 3\nmovwf 0x20\nd: clrf 0x21\ne: nop\ndecfsz 0x21, f\ngoto e\ndecfsz 0x20, f\ngoto d\ngoto w",
    ),
    ("at89s52", "a delay", "w: mov r2, #60\nd: mov r3, #0\ne: djnz r3, e\ndjnz r2, d\nsjmp w"),
    ("at89s52", "in RAM", "w: mov 0x30, #0\ne: nop\ndjnz 0x30, e\nsjmp w"),
    ("at89s52", "polls a flag", "w: jnb 0xcf, w\nsjmp w"),
    ("at89s52", "and clears the watchdog", "w: mov 0xa6, #0x1e\nmov 0xa6, #0xe1\njnb 0xcf, w\nsjmp w"),
];

fn count_instructions<C: Cpu>(mut cpu: C) -> (u64, u64) {
    let mut seen = InstructionCounter(0);
    cpu.set_run_while_halted(true);
    cpu.run(SPAN, &mut seen);
    assert!(cpu.cycle() >= SPAN, "it stops in cycle {}", cpu.cycle());
    (seen.0, cpu.instructions())
}

#[test]
fn waits_are_jumped_over() {
    for &(mcu, what, source) in PROGRAMS {
        let chip = ladder_compile::find_chip(mcu).expect("a chip");
        let image = emu_asm::assemble_text(chip, source).unwrap_or_else(|why| panic!("{what} on {mcu}: {why}"));
        let (seen, all) = match &mcu[..2] {
            "at" if mcu == "at89s52" => count_instructions(Mcs51::new(chip, &image, RamInit::Zero)),
            "at" => count_instructions(Avr::new(chip, &image, RamInit::Zero)),
            _ => count_instructions(Pic16::new(chip, &image, RamInit::Zero)),
        };
        assert!(seen < MOST && all > 10 * MOST, "{what} on {mcu}: {seen} of {all} instructions were carried out");
    }
}
