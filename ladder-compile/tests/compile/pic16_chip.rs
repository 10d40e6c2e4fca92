//! Tests PIC16 images of small ladder programs on the emulated chips: starts of scans, serial line, converter
//! and PWM at their pins, and refusals.

use crate::common::program;
use emu_core::{ChipEvent, Cpu, CycleTime, PinLevel, Probe, RamInit};
use emu_pic16::Pic16;
use ladder_compile::{CellLocation, CompileOptions, CompiledProgram, ImageMap, SpecialPin, compile};

fn compiled(text: &str, mcu: &str, pins: &[(&str, &str)]) -> CompiledProgram {
    let pins = pins.iter().map(|(symbol, pin)| ladder_compile::PinAssignment::new(symbol, pin)).collect();
    let options = CompileOptions { mcu: mcu.to_owned(), pins, ..CompileOptions::default() };
    compile(&program(text), &options).unwrap_or_else(|errors| {
        panic!("{mcu}\n{text}\n{}", errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
    })
}

/// Collects edges of pins and sent bytes with their cycles.
#[derive(Default)]
struct TimedEdgesAndBytes {
    edges: Vec<(u64, emu_core::PinId, PinLevel)>,
    sent: Vec<(u64, u8)>,
}

impl Probe for TimedEdgesAndBytes {
    const EVENTS: bool = true;

    fn on_event(&mut self, event: ChipEvent) -> bool {
        match event {
            ChipEvent::Edge { at, pin, level } => self.edges.push((at.cycle, pin, level)),
            ChipEvent::Sent { at, byte, .. } => self.sent.push((at.cycle, byte)),
            ChipEvent::Contention { .. } | ChipEvent::Reset { .. } => {}
        }
        false
    }
}

struct Pic16Image {
    cpu: Pic16,
    map: ImageMap,
    seen: TimedEdgesAndBytes,
}

impl Pic16Image {
    fn new(compiled: &CompiledProgram) -> Pic16Image {
        let chip = emu_pic16::chips::chip(&compiled.map.mcu).expect("a known chip");
        let loaded =
            emu_core::image::load_hex("image", compiled.hex.as_bytes(), chip.hex_spaces).expect("a sound image");
        let options = emu_pic16::Options { hz: compiled.map.clock_hz, ..emu_pic16::Options::default() };
        let cpu = Pic16::with(chip, &loaded.image, RamInit::Random(7), options);
        Pic16Image { cpu, map: compiled.map.clone(), seen: TimedEdgesAndBytes::default() }
    }

    fn run_to(&mut self, byte: u32) {
        let at = byte / 2;
        self.cpu.set_breakpoint(at, true);
        let limit = self.cpu.cycle() + 100_000_000;
        loop {
            let stop = self.cpu.run(limit, &mut self.seen);
            if self.cpu.pc() == at {
                break;
            }
            assert!(self.cpu.cycle() < limit, "{stop:?} before 0x{at:04X}");
        }
        self.cpu.set_breakpoint(at, false);
    }

    fn scan(&mut self) {
        self.run_to(self.map.scan_start);
        self.run_to(self.map.scan_end);
    }

    fn get(&self, name: &str) -> i32 {
        let found = self.map.symbols.iter().find(|s| s.name == name).expect("a symbol");
        let peek = |addr| self.cpu.peek("data", addr).expect("a place in memory");
        match found.place {
            CellLocation::Bit { addr, bit, .. } => i32::from(peek(addr) >> bit & 1),
            CellLocation::Word { addr, .. } => i16::from_le_bytes([peek(addr), peek(addr + 1)]).into(),
        }
    }

    fn set(&mut self, name: &str, value: i32) {
        let found = self.map.symbols.iter().find(|s| s.name == name).expect("a symbol").place.clone();
        let CellLocation::Word { addr, .. } = found else { panic!("{name} is not an integer") };
        for (addr, byte) in (addr..).zip((value as i16).to_le_bytes()) {
            assert!(self.cpu.poke("data", addr, byte));
        }
    }

    fn drive(&mut self, pin: &str, level: PinLevel) {
        let (now, pin) = (CycleTime::at(self.cpu.cycle()), self.cpu.chip().pin(pin).expect("a pin"));
        self.cpu.drive(now, pin, level);
    }
}

/// Chip, clock in Hz, cycle in microseconds, machine cycles per count, scans.
///
/// The last rows of each clock are the longest periods that it can pace, up to a few counts.
#[rustfmt::skip]
const PACES: &[(&str, u64, u64, u32, u64)] = &[
    ("pic16f876",   4_000_000,   10_000,   4, 1000),
    ("pic16f877",   4_000_000,    7_919,   1, 1000),
    ("pic16f873",  20_000_000,   10_000,   1, 1000),
    ("pic16f873a", 20_000_000,    1_000,   4, 2000),
    ("pic16f628",  20_000_000,    7_919,   1, 1000),
    ("pic16f88",   11_059_200,   10_000,  16, 1000),
    ("pic16f819",  11_059_200,    7_919,   1, 1000),
    ("pic16f874",   3_579_545,   10_000,   1, 1000),
    ("pic16f874a",  3_579_545,  100_003,   2,  300),
    ("pic16f877a", 11_059_200,   47_407,   4,  300),
    ("pic16f876a", 11_059_200,  189_613,   8,  100),
    ("pic16f876a", 20_000_000,  100_003,   8,  100),
    ("pic16f876a", 20_000_000,   49_999,   4,  200),
    ("pic16f628a",     32_768,  100_000,   1,  500),
    ("pic16f877",      32_768, 1_000_003,  1,  100),
    ("pic16f877",   4_000_000,  524_280,   8,   40),
    ("pic16f877",   4_000_000,  524_279,   8,   40),
];

#[test]
fn scans_start_with_their_match_without_drift() {
    for &(mcu, clock, cycle, tick, scans) in PACES {
        follow(mcu, clock, cycle, tick, 5, scans, "ADD b b 1");
    }
}

/// Cases with timer 1 extended in RAM: the only CCP module is used for PWM, or the period is too long for it.
///
/// Chip, clock in Hz, cycle in microseconds, maximum cycles from a match to its scan, scans, and an element.
#[rustfmt::skip]
const LENGTHENED: &[(&str, u64, u64, u64, u64, &str)] = &[
    ("pic16f628",   4_000_000,     10_000,  5, 500, "SET_PWM b 1000"),
    ("pic16f628a", 20_000_000,      7_919,  5, 500, "SET_PWM b 5000"),
    ("pic16f88",   11_059_200,     10_000,  5, 500, "SET_PWM b 5000"),
    ("pic16f88",   11_059_200,      7_919,  5, 999, "SET_PWM b 5000"),
    ("pic16f819",   3_579_545,     10_001,  5, 999, "SET_PWM b 5000"),
    ("pic16f819",     999_999,      1_003,  5, 999, "SET_PWM b 1000"),
    // Around the 16-bit limit: an overflow soon after a match may belong to this match or to the next one.
    ("pic16f628",   4_000_000,     65_535,  5, 100, "SET_PWM b 1000"),
    ("pic16f628",   4_000_000,     65_536,  8, 100, "SET_PWM b 1000"),
    ("pic16f628",   4_000_000,     65_537,  8, 100, "SET_PWM b 1000"),
    ("pic16f628",   4_000_000,     65_543,  8, 100, "SET_PWM b 1000"),
    ("pic16f628",   4_000_000,     65_556,  8, 100, "SET_PWM b 1000"),
    ("pic16f628",   4_000_000,     65_559,  8, 100, "SET_PWM b 1000"),
    ("pic16f628",   4_000_000,     65_562,  8, 100, "SET_PWM b 1000"),
    ("pic16f628",   4_000_000,     65_799,  8, 100, "SET_PWM b 1000"),
    ("pic16f628",   4_000_000,     70_000,  8, 100, "SET_PWM b 1000"),
    ("pic16f628",   3_999_999,    131_089,  8,  50, "SET_PWM b 1000"),
    ("pic16f88",   11_059_200,  1_000_003,  8,  20, "SET_PWM b 5000"),
    ("pic16f819",   4_000_000, 16_777_216, 10,   2, "SET_PWM b 1000"),
    ("pic16f628",   4_000_000, 16_711_695,  8,   2, "SET_PWM b 1000"),
    // Too long for CCP1.
    ("pic16f873",   4_000_000,    524_281,  8,  20, "ADD b b 1"),
    ("pic16f873",   4_000_000,  1_000_000,  8,  20, "ADD b b 1"),
    ("pic16f877",   3_579_545,  1_000_000,  8,  20, "ADD b b 1"),
    ("pic16f876a", 11_059_200,  1_000_003,  8,  20, "ADD b b 1"),
    ("pic16f873",   4_000_000, 10_000_000,  8,   2, "ADD b b 1"),
];

#[test]
fn a_lengthened_timer_does_not_drift() {
    for &(mcu, clock, cycle, poll, scans, element) in LENGTHENED {
        follow(mcu, clock, cycle, 1, poll, scans, element);
    }
}

/// Checks the start of every scan against its match, and the values in the map.
fn follow(mcu: &str, clock: u64, cycle: u64, tick: u32, poll: u64, scans: u64, element: &str) {
    let text = format!(
        "LDmicro0.1\nCYCLE={cycle}\nCRYSTAL={clock}\nIO LIST\nEND\nPROGRAM\nRUNG\nCONTACTS Xa 0\nPARALLEL\n{element}\nCOIL Yc 0 0 0\nEND\nEND\n"
    );
    let mut chip = Pic16Image::new(&compiled(&text, mcu, &[]));
    let map = chip.map.clone();
    let case = format!("{mcu}, {clock} Hz, {cycle} us");
    assert_eq!((map.tick, u64::from(map.poll_cycles)), (tick, poll), "{case}");
    chip.run_to(map.timer_start);
    // The instruction takes one cycle.
    let start = chip.cpu.cycle() + 1;
    for k in 1..=scans {
        chip.run_to(map.scan_start);
        let now = chip.cpu.cycle() - start;
        let exact = (u128::from(k) * u128::from(map.cycle.num) / u128::from(map.cycle.den)) as u64;
        let earliest = exact.saturating_sub(u64::from(map.tick) - 1);
        let latest = exact + u64::from(map.poll_cycles);
        let found = (earliest..=latest).contains(&now);
        assert!(found, "{case}: scan {k} starts at {now}, wanted {earliest} to {latest}");
        chip.run_to(map.scan_end);
    }
}

const HEAD: &str = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nBAUD=9600\nIO LIST\nEND\nPROGRAM\n";

#[test]
fn pins_arithmetic_and_timers_on_every_chip() {
    let rungs =
        "RUNG\nCONTACTS Xa 0\nTON Ta 30000\nCOIL Yb 0 0 0\nEND\nRUNG\nPARALLEL\nMUL c Ta -300\nDIV d c 7\nEND\nEND\n";
    for target in ladder_compile::pic16::TARGETS {
        let mut chip =
            Pic16Image::new(&compiled(&format!("{HEAD}{rungs}"), target.chip.name, &[("Xa", "RB0"), ("Yb", "RB5")]));
        chip.drive("RB0", PinLevel::High);
        let pin = chip.cpu.chip().pin("RB5").expect("a pin");
        // Outputs change only with the last instructions of a scan; RB5 is high from the third scan on.
        for scan in 1..=5 {
            chip.scan();
            chip.run_to(chip.map.poll);
            let name = target.chip.name;
            assert_eq!(chip.get("Yb"), i32::from(scan >= 3), "{name}, scan {scan}");
            assert_eq!(chip.cpu.pin_level(pin), PinLevel::from_bit(scan >= 3), "{name}, scan {scan}");
            assert_eq!(
                (chip.get("c"), chip.get("d")),
                (scan.min(2) * -300, scan.min(2) * -300 / 7),
                "{name}, scan {scan}"
            );
        }
        // Low when the pin becomes an output, high once: no glitch.
        let levels: Vec<PinLevel> = chip.seen.edges.iter().filter(|edge| edge.1 == pin).map(|edge| edge.2).collect();
        assert_eq!(levels, [PinLevel::Low, PinLevel::High], "{}", target.chip.name);
    }
}

#[test]
fn the_serial_line_sends_and_receives() {
    let rungs = "RUNG\nUART_RECV got\nPARALLEL\nADD next got 1\nCOIL Rgot 0 0 0\nEND\nEND\nRUNG\nCONTACTS Rgot 0\nUART_SEND next\nEND\n";
    for mcu in ["pic16f873", "pic16f877", "pic16f628", "pic16f88", "pic16f876a"] {
        let compiled = compiled(&format!("{HEAD}{rungs}"), mcu, &[]);
        let mut chip = Pic16Image::new(&compiled);
        let target = ladder_compile::find_target(mcu).expect("a target");
        let (_, receive) = target.uart.expect("a serial line");
        let bit = compiled.map.specials.iter().find_map(|s| match s {
            SpecialPin::Transmit { bit, .. } => Some(bit.num / bit.den),
            _ => None,
        });
        let bit = bit.expect("the transmitter is in the map");
        let mut wanted = Vec::new();
        chip.drive(receive, PinLevel::High);
        chip.scan();
        for byte in [0x55u8, 0x00, 0xFE, 0x81] {
            // Start bit, eight data bits, stop bit, starting during the wait of a scan.
            let from = chip.cpu.cycle() + 500;
            let pin = chip.cpu.chip().pin(receive).expect("a pin");
            let bits = std::iter::once(false).chain((0..8).map(|n| byte >> n & 1 == 1)).chain([true]);
            for (n, level) in bits.enumerate() {
                chip.cpu.drive(CycleTime::at(from + n as u64 * bit), pin, PinLevel::from_bit(level));
            }
            chip.scan();
            assert_eq!((chip.get("got"), chip.get("Rgot")), (i32::from(byte), 1), "{mcu}, {byte:02X}");
            chip.scan();
            assert_eq!((chip.get("got"), chip.get("Rgot")), (i32::from(byte), 0), "{mcu}, {byte:02X}");
            wanted.push(byte.wrapping_add(1));
            chip.scan();
        }
        let sent: Vec<u8> = chip.seen.sent.iter().map(|&(_, byte)| byte).collect();
        assert_eq!(sent, wanted, "{mcu}");
    }
}

#[test]
fn the_pulse_is_as_wide_as_the_duty() {
    for (mcu, hertz) in [
        ("pic16f873", 1000),
        ("pic16f877", 2000),
        ("pic16f876a", 245),
        ("pic16f874a", 20_000),
        ("pic16f628", 1000),
        ("pic16f628a", 245),
        ("pic16f88", 2000),
        ("pic16f819", 20_000),
    ] {
        let text = format!("{HEAD}RUNG\nSET_PWM duty {hertz}\nEND\n");
        let compiled = compiled(&text, mcu, &[]);
        let mut chip = Pic16Image::new(&compiled);
        let pwm = compiled.map.specials.iter().find_map(|s| match s {
            SpecialPin::Pwm { period, steps, pin, .. } => {
                Some((period.num / period.den, u64::from(*steps), pin.clone()))
            }
            _ => None,
        });
        let (period, steps, pin) = pwm.expect("the output is in the map");
        assert!((1_000_000 * 95..=1_000_000 * 105).contains(&(period * hertz * 100)), "{mcu}: {period}");
        let pin = chip.cpu.chip().pin(&pin).expect("a pin");
        chip.run_to(chip.map.scan_start);
        assert_eq!(chip.cpu.pin_level(pin), PinLevel::Low, "{mcu} before the first duty");
        for duty in [0, 1, 2, 33, 50, 67, 98, 99, 100, 0, 100, -5, 140, -30000, 30000, 256] {
            chip.run_to(chip.map.scan_start);
            chip.set("duty", duty);
            chip.run_to(chip.map.scan_end);
            // The new pulse width starts with the next period of the timer.
            let settled = chip.cpu.cycle() + 2 * period;
            chip.cpu.run(settled, &mut chip.seen);
            chip.seen.edges.clear();
            let (mut level, mut last) = (chip.cpu.pin_level(pin), chip.cpu.cycle());
            let end = last + period;
            chip.cpu.run(end, &mut chip.seen);
            let end = chip.cpu.cycle();
            let mut high = 0;
            for &(at, edge, to) in chip.seen.edges.iter().filter(|(_, edge, _)| *edge == pin) {
                assert_eq!(edge, pin);
                high += if level == PinLevel::High { at - last } else { 0 };
                (level, last) = (to, at);
            }
            high += if level == PinLevel::High { end - last } else { 0 };
            let wanted = duty.clamp(0, 100) as u64;
            let all = end - (end - period);
            let edges = chip.seen.edges.iter().filter(|(_, edge, _)| *edge == pin).count();
            match wanted {
                0 => assert_eq!((high, edges), (0, 0), "{mcu}, {duty} %"),
                100 => assert!(edges == 0 && high >= all, "{mcu}, {duty} %: {high} of {all}"),
                _ => {
                    let step = period.div_ceil(steps) + 3;
                    assert!((high * 100).abs_diff(wanted * all) <= 100 * step, "{mcu}, {duty} %: {high} of {all}");
                }
            }
        }
    }
}

#[test]
fn the_converter_reads_beside_digital_inputs() {
    let rungs = "RUNG\nPARALLEL\nREAD_ADC Aone\nREAD_ADC Atwo\nEND\nEND\nRUNG\nCONTACTS Xa 0\nCOIL Yb 0 0 0\nEND\n";
    for (mcu, one, two) in [
        ("pic16f873", "RA1", "RA3"),
        ("pic16f877a", "RE2", "RA5"),
        ("pic16f88", "RB6", "RA1"),
        ("pic16f819", "RA4", "RA1"),
    ] {
        let mut chip = Pic16Image::new(&compiled(
            &format!("{HEAD}{rungs}"),
            mcu,
            &[("Aone", one), ("Atwo", two), ("Xa", "RA0"), ("Yb", "RA2")],
        ));
        for (scan, value) in [0u32, 1, 511, 512, 1022, 1023, 300].into_iter().enumerate() {
            for (pin, value) in [(one, value), (two, 1023 - value)] {
                let (now, id) = (CycleTime::at(chip.cpu.cycle()), chip.cpu.chip().pin(pin).expect("a pin"));
                assert!(chip.cpu.drive_volts(now, id, (value * 2 + 1) * 5000 / 2048));
            }
            chip.drive("RA0", PinLevel::from_bit(scan % 2 == 0));
            chip.scan();
            let found = (chip.get("Aone"), chip.get("Atwo"), chip.get("Yb"));
            assert_eq!(found, (value as i32, 1023 - value as i32, i32::from(scan % 2 == 0)), "{mcu}, scan {scan}");
        }
    }
}

/// Unsupported programs are refused with numbers.
#[test]
fn what_the_chip_cannot_do_is_refused_with_the_figures() {
    let refused = |text: &str, mcu: &str| {
        let options = CompileOptions { mcu: mcu.to_owned(), ..CompileOptions::default() };
        let errors = compile(&program(text), &options).expect_err("it is refused");
        errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
    };
    let head = |cycle: u64, clock: u64, baud: u64| {
        format!("LDmicro0.1\nCYCLE={cycle}\nCRYSTAL={clock}\nBAUD={baud}\nIO LIST\nEND\nPROGRAM\n")
    };
    let coil = "RUNG\nCONTACTS Xa 0\nCOIL Yb 0 0 0\nEND\n";
    let many: String =
        (0..60).map(|n| format!("RUNG\nPARALLEL\nMOVE v{n} {n}\nMUL w{n} v{n} v{n}\nEND\nEND\n")).collect();
    let long: String = (0..300)
        .map(|n| format!("RUNG\nCONTACTS Xa 0\nPARALLEL\nDIV a b c\nMUL b c a\nADD c a {n}\nEND\nEND\n"))
        .collect();
    for (text, mcu, words) in [
        (head(900_000_000, 20_000_000, 9600) + coil, "pic16f873", "858993458"),
        (head(10_000, 32_768, 9600) + "RUNG\nUART_SEND a\nEND\n", "pic16f877", "2048"),
        (head(10_000, 4_000_000, 9600) + "RUNG\nSET_PWM a 100\nEND\n", "pic16f877", "245"),
        (head(10_000, 4_000_000, 9600) + &many, "pic16f873", "192"),
        (head(200_000, 4_000_000, 9600) + &long, "pic16f628", "4096"),
        (head(10_000, 4_000_000, 9600) + "RUNG\nSET_PWM a 100\nEND\n", "pic16f628", "245"),
        (head(10_000, 4_000_000, 9600) + "RUNG\nUART_SEND a\nEND\n", "pic16f819", "serial"),
    ] {
        let said = refused(&text, mcu);
        assert!(said.contains(words), "{mcu}: {said}");
    }
}

#[test]
fn an_open_drain_is_reported() {
    let compiled = compiled(&format!("{HEAD}RUNG\nCONTACTS Xa 0\nCOIL Yb 0 0 0\nEND\n"), "pic16f873", &[("Yb", "RA4")]);
    let notes: Vec<String> = compiled.notes.iter().map(ToString::to_string).collect();
    assert!(notes.iter().any(|note| note.contains("open drain")), "{notes:?}");
}

/// Clock in Hz, chip, configuration words: FOSC by the clock, no watchdog, no LVP, no protection.
#[test]
fn configuration_words_are_in_the_hex_file() {
    #[rustfmt::skip]
    let cases: &[(&str, u64, u32, &[u16])] = &[
        ("pic16f873",   4_000_000, 10_000, &[0x3F71]),
        ("pic16f877a", 20_000_000, 10_000, &[0x3F72]),
        ("pic16f876",      32_768, 100_000, &[0x3F70]),
        ("pic16f628",   4_000_000, 10_000, &[0x3D61]),
        ("pic16f88",   20_000_000, 10_000, &[0x3F62, 0x3FFC]),
    ];
    for (mcu, clock, cycle, wanted) in cases {
        let text = format!(
            "LDmicro0.1\nCYCLE={cycle}\nCRYSTAL={clock}\nIO LIST\nEND\nPROGRAM\nRUNG\nCONTACTS Xa 0\nCOIL Yb 0 0 0\nEND\n"
        );
        let chip = emu_pic16::chips::chip(mcu).expect("a chip");
        let hex = compiled(&text, mcu, &[]).hex;
        let image = emu_core::image::load_hex("image", hex.as_bytes(), chip.hex_spaces).expect("a sound image").image;
        let mut bytes = vec![0; 0x0E + 2 * wanted.len()];
        image.fill("config", &mut bytes);
        let found: Vec<u16> = bytes[0x0E..].chunks(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
        assert_eq!(&found, wanted, "{mcu}");
    }
}

/// Rungs with calls, loops and jumps: none takes longer than the map states, for any values.
#[test]
fn rungs_take_no_longer_than_the_map_says() {
    for duty in ["72", "n"] {
        let rungs = format!(
            "RUNG\nSET_PWM {duty} 5420\nEND\nRUNG\nMUL b n 77\nEND\nRUNG\nDIV c n b\nEND\n\
             RUNG\nPARALLEL\nCTU Ca 3\nSERIES\nOSR\nCONTACTS Xa 0\nEND\nCTC Cb 9\nEND\nCOIL Ya 0 0 0\nEND\n"
        );
        let text = format!("LDmicro0.1\nCYCLE=10000\nCRYSTAL=11059200\nIO LIST\nEND\nPROGRAM\n{rungs}");
        let mut chip = Pic16Image::new(&compiled(&text, "pic16f873", &[]));
        let map = chip.map.clone();
        for n in [0, 1, 50, 99, 100, 101, -1, 32767, -32768, 257] {
            chip.run_to(map.scan_start);
            chip.set("n", n);
            for rung in &map.rungs {
                chip.run_to(rung.start);
                let start = chip.cpu.cycle();
                chip.run_to(rung.end);
                let (took, most) = (chip.cpu.cycle() - start, rung.worst_cycles);
                assert!(took > 0 && took <= most, "n = {n}, rung {}: {took} cycles, {most} by the map", rung.rung);
            }
            chip.run_to(map.scan_end);
        }
    }
}
