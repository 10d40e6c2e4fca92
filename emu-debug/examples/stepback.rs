//! Measures how long a step back takes after 10^9 cycles, and how much memory the history uses: `cargo run
//! --release -p plcemu-debug --example stepback`.

use std::time::{Duration, Instant};

use emu_core::Chip;
use emu_core::cpu::RamInit;
use emu_core::image::{self, ElfMachine, Image};
use emu_debug::CycleClock;
use emu_debug::debug::{DebugSession, DynMachine, HistorySize, NameScope, RunGoal, SessionOptions};
use emu_test_machines::DebugMachine;

/// Cycles that run first.
const CYCLES: u64 = 1_000_000_000;

/// Frequency of the clock in Hz.
const HZ: u64 = 16_000_000;

/// Number of steps back that are timed.
const STEPS: usize = 101;

/// Counts forever, and writes a port in every iteration.
const COUNTER: &str = "ldi r24, 0xff\nout 0x04, r24\nagain: inc r16\nbrne again\ninc r17\nout 0x05, r17\nrjmp again\n";

fn load(chip: &'static Chip, file: &str) -> Image {
    if file == "counter" {
        return emu_asm::assemble_text(chip, COUNTER).expect("a program");
    }
    let path = format!("{}/../{file}", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(&path).expect("an image");
    image::load(file, &bytes, chip.hex_spaces, chip.elf_spaces, ElfMachine(chip.elf_machine)).expect("an image").image
}

fn main() {
    let avr = &emu_avr::chips::ATMEGA328P;
    let mcs51 = emu_8051::chips::chips().find(|chip| chip.name == "8052").expect("8052");
    let pic = emu_pic16::chips::chips().find(|chip| chip.name == "pic16f877a").expect("pic16f877a");
    type Build = fn(&'static Chip, &Image) -> Box<dyn DynMachine>;
    let machines: [(&str, &'static Chip, Build); 4] = [
        ("counter", avr, |chip, image| emu_avr::Avr::new(chip, image, RamInit::Zero).boxed(HZ)),
        ("examples/avr/sort.elf", avr, |chip, image| emu_avr::Avr::new(chip, image, RamInit::Zero).boxed(HZ)),
        ("examples/8051/traffic.hex", mcs51, |chip, image| {
            emu_8051::Mcs51::with(chip, image, RamInit::Zero, emu_8051::Options::default()).boxed(HZ)
        }),
        ("examples/pic16/blink.hex", pic, |chip, image| {
            emu_pic16::Pic16::with(chip, image, RamInit::Zero, emu_pic16::Options::default()).boxed(HZ)
        }),
    ];
    for (file, chip, build) in machines {
        let target = build(chip, &load(chip, file));
        let clock = CycleClock { hz: chip.default_hz, clocks_per_cycle: target.clocks_per_cycle() };
        let mut session = DebugSession::new(
            target,
            NameScope::new(chip),
            SessionOptions { clock, max_copy_bytes: 64 << 20, follower: None },
        );
        let start = Instant::now();
        let until = Some(CYCLES);
        let halt = session.run(&RunGoal { until, ..RunGoal::default() }, &mut || true);
        let took = start.elapsed();
        let HistorySize { copies, bytes } = session.history_size();
        let mut times: Vec<Duration> = Vec::new();
        for n in 0..STEPS {
            // From the end, and from positions spread over the history.
            if n % 2 == 1 {
                session.goto_cycle(session.machine().cycle() - CYCLES / (STEPS as u64 + 2), &mut || true);
            }
            let start = Instant::now();
            session.step_back(1, &mut || true);
            times.push(start.elapsed());
        }
        times.sort();
        println!(
            "{file} on {}: {:?} at cycle {}, run {took:.2?}, {copies} copies in {} KB; step back: first half of {STEPS} under {:.2?}, slowest {:.2?}",
            chip.name,
            halt,
            session.machine().cycle(),
            bytes >> 10,
            times[STEPS / 2],
            times[STEPS - 1],
        );
    }
}
