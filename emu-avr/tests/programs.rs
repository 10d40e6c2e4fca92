//! Programs as text, run in one go, in random slices, from clones in the middle, with and without skipped
//! polling loops, and with every hook of a probe. All runs must end in the same machine.

use emu_avr::{Avr, chips};
use emu_core::image::Image;
use emu_core::rng::Rng;
use emu_core::{Cpu, Probe, ProgramError, RamInit, StopReason};

const LIMIT: u64 = 4_000_000;

struct Program {
    name: String,
    image: Image,
    wanted: Vec<String>,
}

fn parse(text: &str) -> Vec<Program> {
    let mut programs = Vec::new();
    for part in text.split("\n== ").skip(1) {
        let (name, rest) = part.split_once('\n').expect("a name line");
        let (code, wanted) = rest.split_once("\n-- ").unwrap_or_else(|| panic!("{name}: no expectations"));
        let wanted =
            wanted.lines().take_while(|l| !l.starts_with('#')).flat_map(|l| l.split(';')).map(|w| w.trim().to_owned());
        let chip = chips::chip("atmega328p").expect("chip");
        let image = emu_asm::assemble_text(chip, code).unwrap_or_else(|e| panic!("{name}: {e}"));
        programs.push(Program { name: name.to_owned(), image, wanted: wanted.filter(|w| !w.is_empty()).collect() });
    }
    programs
}

fn number(text: &str) -> u64 {
    text.strip_prefix("0x")
        .map_or_else(|| text.parse(), |h| u64::from_str_radix(h, 16))
        .unwrap_or_else(|_| panic!("{text}: no number"))
}

fn chip(program: &Program) -> Avr {
    let mut avr = Avr::new(chips::chip("atmega328p").expect("chip"), &program.image, RamInit::Zero);
    for wanted in &program.wanted {
        if let Some(addr) = wanted.strip_prefix("stop ") {
            avr.set_breakpoint(number(addr) as u32 / 2, true);
        }
    }
    avr
}

/// Returns everything that a program can see, and the instruction count.
fn state(avr: &Avr) -> (Vec<Option<u8>>, u32, u64, u64) {
    ((0..0x900).map(|a| avr.peek("data", a)).collect(), avr.pc(), avr.cycle(), avr.instructions())
}

fn arrival(program: &Program, addr: &str) -> u64 {
    let mut avr = chip(program);
    avr.set_breakpoint(number(addr) as u32 / 2, true);
    loop {
        match avr.run(LIMIT, &mut ()) {
            StopReason::Breakpoint { pc } if u64::from(pc) * 2 == number(addr) => return avr.cycle(),
            StopReason::Breakpoint { .. } => {}
            other => panic!("{}: {addr} is not reached: {other:?}", program.name),
        }
    }
}

fn judge(program: &Program, avr: &Avr, stop: StopReason) {
    let name = &program.name;
    for wanted in &program.wanted {
        let words: Vec<&str> = wanted.split_whitespace().collect();
        match words[..] {
            ["stop", addr] => assert_eq!(stop, StopReason::Breakpoint { pc: number(addr) as u32 / 2 }, "{name}"),
            ["halted"] => assert_eq!(stop, StopReason::Halted, "{name}"),
            ["fault"] => assert!(matches!(stop, StopReason::Error(ProgramError::Fault { .. })), "{name}: {stop:?}"),
            ["illegal", word] => assert!(
                matches!(stop, StopReason::Error(ProgramError::Illegal { word: w, .. }) if u64::from(w) == number(word)),
                "{name}: {stop:?}"
            ),
            ["pc", addr] => assert_eq!(u64::from(avr.pc()) * 2, number(addr), "{name}: pc"),
            ["instructions", n] => assert_eq!(avr.instructions(), number(n), "{name}: instructions"),
            ["from", a, "to", b, "=", n] => {
                assert_eq!(arrival(program, b) - arrival(program, a), number(n), "{name}: cycles from {a} to {b}");
            }
            _ => {
                for item in &words {
                    let (place, value) = item.split_once('=').unwrap_or_else(|| panic!("{name}: {wanted}"));
                    let value = u32::from_str_radix(value, 16).unwrap_or_else(|_| panic!("{name}: {wanted}"));
                    let found = match place.strip_prefix("data:") {
                        Some(addr) => avr.peek("data", number(addr) as u32).map(u32::from),
                        None => avr.reg(place),
                    };
                    assert_eq!(found, Some(value), "{name}: {place} is {found:02x?}, wanted {value:02x}");
                }
            }
        }
    }
}

fn programs() -> Vec<Program> {
    let files = [
        include_str!("programs/core.txt"),
        include_str!("programs/facts.txt"),
        include_str!("programs/facts_timers.txt"),
    ];
    files.into_iter().flat_map(parse).collect()
}

#[test]
fn programs_end_as_the_data_sheet_says() {
    let programs = programs();
    assert!(programs.len() > 15);
    for program in &programs {
        let mut avr = chip(program);
        let stop = avr.run(LIMIT, &mut ());
        judge(program, &avr, stop);
    }
}

/// Probe that observes everything and stops nothing.
#[derive(Default)]
struct All(u64);

impl Probe for All {
    const INSN: bool = true;
    const DATA: bool = true;
    const EVENTS: bool = true;
    fn on_instruction(&mut self, _: u64, _: u32) -> bool {
        self.0 += 1;
        false
    }
}

#[test]
fn any_way_of_running_gives_the_same_machine() {
    let seed = 0x5eed_0001;
    let mut rng = Rng::new(seed);
    for program in &programs() {
        let mut whole = chip(program);
        let stop = whole.run(LIMIT, &mut ());
        let wanted = (state(&whole), stop);

        let mut plain = chip(program);
        plain.set_skip_idle_loops(false);
        let stop = plain.run(LIMIT, &mut ());
        assert_eq!((state(&plain), stop), wanted, "{}: without jumping over loops", program.name);

        let mut probed = chip(program);
        let mut all = All::default();
        let stop = probed.run(LIMIT, &mut all);
        assert_eq!((state(&probed), stop), wanted, "{}: with a probe", program.name);
        // An instruction that stops a run without being executed has been observed once.
        let extra = u64::from(matches!(stop, StopReason::Error(_)));
        assert_eq!(all.0, probed.instructions() + extra, "{}: instructions seen", program.name);

        for _ in 0..20 {
            let mut avr = chip(program);
            // Short slices of a long wait would take too long.
            let shortest = if whole.cycle() > 20_000 { 2 } else { 0 };
            let longest = [3, 50, 5000, 100_000][(shortest + rng.below(4 - shortest)) as usize];
            let stop = loop {
                let until = avr.cycle() + 1 + rng.below(longest);
                let mut copy = avr.clone();
                let stop = avr.run(until.min(LIMIT), &mut ());
                if rng.one_in(4) {
                    assert_eq!(copy.run(until.min(LIMIT), &mut ()), stop, "{}: seed {seed:x}", program.name);
                    assert_eq!(state(&copy), state(&avr), "{}: a clone, seed {seed:x}", program.name);
                    avr = copy;
                }
                if stop != StopReason::Limit || avr.cycle() >= LIMIT {
                    break stop;
                }
            };
            assert_eq!((state(&avr), stop), wanted, "{}: in slices, seed {seed:x}", program.name);
        }

        let mut stepped = chip(program);
        let stop = loop {
            let stop = stepped.step(&mut ());
            if stop != StopReason::Limit || stepped.cycle() > LIMIT || stepped.instructions() > 20_000 {
                break stop;
            }
        };
        if stepped.instructions() <= 20_000 {
            assert_eq!((state(&stepped), stop), wanted, "{}: step by step", program.name);
        }
    }
}

/// Enters a loop that polls a timer flag at every distance from the match, with every short period. With
/// skipping, it must be left at the same cycle as without, and again in the next pass.
#[test]
fn polls_are_left_at_every_distance_from_the_match() {
    for nops in 0..12 {
        for ocr in 8..30 {
            let text = format!(
                "\n== {nops} nops, OCR0A {ocr}\n ldi r16,{ocr}\n out 0x27,r16\n ldi r16,2\n out 0x24,r16\n ldi r17,1\n \
                 out 0x25,r17\n.rept {nops}\n nop\n.endr\n rjmp 0x80\n.org 0x80\n sbis 0x15,1\n rjmp .-4\n sbi 0x15,1\n inc r20\n rjmp .-10\n-- stop 0x86\n"
            );
            let program = &parse(&text)[0];
            let (mut jumping, mut plain) = (chip(program), chip(program));
            plain.set_skip_idle_loops(false);
            for round in 0..4 {
                let wanted = plain.run(10_000, &mut ());
                assert_eq!(jumping.run(10_000, &mut ()), wanted, "{}", program.name);
                assert_eq!(state(&jumping), state(&plain), "{}, round {round}", program.name);
            }
        }
    }
}

/// Waits without a limit end at the maximum cycle, and a stop at a watched write is not lost to a watchdog
/// reset at the same boundary.
#[test]
fn the_end_of_time_and_a_stop_beside_a_reset() {
    let waits = "\n== sleep for a byte\n ldi r16,0x90\n sts 0xC1,r16\n ldi r16,1\n out 0x33,r16\n sei\n sleep\n-- x\n\
                 \n== poll a pin\n sbis 0x03,0\n rjmp .-4\n-- x\n";
    for program in parse(waits) {
        let mut avr = chip(&program);
        for _ in 0..2 {
            assert_eq!(avr.run(u64::MAX, &mut ()), StopReason::Limit, "{}", program.name);
            assert_eq!(avr.step(&mut ()), StopReason::Limit, "{}", program.name);
        }
    }
    /// Probe that stops at every write of data:0x100.
    #[derive(Default)]
    struct Watch(u32);
    impl Probe for Watch {
        const DATA: bool = true;
        fn on_data_access(&mut self, _: u64, _: u8, addr: u16, _: u8, write: bool) -> bool {
            self.0 += u32::from(write && addr == 0x100);
            write && addr == 0x100
        }
    }
    let program = &parse(
        "\n== dog\n ldi r16,0x18\n sts 0x60,r16\n ldi r16,8\n sts 0x60,r16\n sts 0x100,r16\n.rept 3\n nop\n.endr\n rjmp .-12\n-- x\n",
    )[0];
    let mut avr = chip(program);
    avr.set_clock_hz(1000);
    let (mut watch, mut stops) = (Watch::default(), 0);
    while avr.run(4000, &mut watch) == StopReason::Probe {
        stops += 1;
    }
    assert!(stops > 100);
    assert_eq!(stops, watch.0, "every write stops the run");
}
