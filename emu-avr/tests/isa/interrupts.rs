//! Any slicing gives the same run, with interrupts of timers and serial port, sleep, and interrupts being
//! enabled and disabled.

use emu_avr::chips::ATMEGA328P;
use emu_core::Cpu;
use emu_core::rng::Rng;

use super::slices::{machine, same_however_cut};

const SEED: u64 = 0x5EED_0003;

/// Pieces of the main loop. r16 holds any value, r17 80h and r18 00h.
const PIECES: &[&[&str]] = &[
    &["nop"],
    &["mul r2, r3"],
    &["push r0", "pop r1"],
    &["lpm r4, Z+"],
    &["cli"],
    &["sei"],
    &["sei", "sleep"],
    &["sei", "nop", "sleep"],
    &["out 0x3F, r17"],
    &["in r16, 0x3F", "cli", "inc r5", "out 0x3F, r16"],
    &["sts 0x005F, r17"],
    &["lds r6, 0x0046", "add r7, r6"],
    &["lds r6, 0x0084", "lds r8, 0x0085"],
    &["in r6, 0x15", "add r7, r6"],
    &["sbi 0x15, 1"],
    &["sts 0x00C6, r7"],
    &["sts 0x0046, r7"],
    &["bst r6, 0", "brts .+2", "sei"],
    &["sbis 0x16, 1", "rjmp .-4"],
];

/// Returns pairs of register and value that start the timers and the serial port.
fn set_up(rng: &mut Rng) -> Vec<(u16, u8)> {
    let mut any = |mask: u8| rng.next_u64() as u8 & mask;
    vec![
        (0x44, any(2)),
        (0x47, any(63) | 4),
        (0x48, any(63)),
        (0x6E, any(7)),
        (0x45, any(3)),
        (0x89, any(1)),
        (0x88, any(255) | 16),
        (0x8A, any(255)),
        (0x6F, any(7)),
        // CTC mode, so that polls of OCF1A end.
        (0x81, 8 | any(1) | 1),
        (0xB0, any(2)),
        (0xB3, any(255) | 4),
        (0x70, any(7)),
        (0xB1, any(7)),
        (0xC4, any(7)),
        (0xC1, 0x08 | any(0x60)),
        (0x53, 1),
    ]
}

fn program(rng: &mut Rng) -> Vec<u16> {
    let mut words: Vec<u16> = Vec::new();
    let mut line = |text: &str| {
        let new =
            emu_asm::assemble_line(&ATMEGA328P, text, words.len() as u32).unwrap_or_else(|e| panic!("{text}: {e}"));
        words.extend(new);
        words.len()
    };
    line("jmp 0x0068");
    // Every vector counts in its own register; r25 is the last of 25.
    for vector in 1..26 {
        line(&format!("inc r{vector}"));
        line("reti");
    }
    for (register, value) in set_up(rng) {
        line(&format!("ldi r16, {value}"));
        line(&format!("sts {register}, r16"));
    }
    line("ldi r17, 0x80");
    line("ldi r18, 0");
    let body = line("sei") * 2;
    for _ in 0..40 {
        for text in PIECES[rng.below(PIECES.len() as u64) as usize] {
            line(text);
        }
    }
    line("ldi r17, 0x80");
    line(&format!("rjmp {body}"));
    words
}

#[test]
fn interrupts_fall_on_the_same_cycle_however_the_run_is_cut() {
    let mut rng = Rng::new(SEED);
    for n in 0..40 {
        let seed = rng.next_u64();
        let avr = machine(&program(&mut rng), seed);
        let until = 2000 + rng.below(8000);
        same_however_cut(&format!("seed {SEED:#x}, program {n}"), &avr, until, &mut rng);
    }
}

#[test]
fn the_programs_are_interrupted() {
    struct Count(usize);
    impl emu_core::Probe for Count {
        fn on_interrupt(&mut self, _: u64, _: u8) {
            self.0 += 1;
        }
    }
    let mut rng = Rng::new(SEED ^ 1);
    let mut counts: Vec<usize> = (0..20)
        .map(|seed| {
            let mut count = Count(0);
            machine(&program(&mut rng), seed).run(5000, &mut count);
            count.0
        })
        .collect();
    counts.sort_unstable();
    assert!(counts[10] > 20, "interrupts in 5000 cycles: {counts:?}");
}
