//! Tests images for the 8051 family on the emulated chips: starts of scans, levels at pins, bytes sent and
//! received.

use crate::common::program;
use emu_8051::Mcs51;
use emu_core::rng::Rng;
use emu_core::{ChipEvent, Cpu, CycleTime, PinLevel, Probe, RamInit};
use ladder_compile::mcs51::{TARGETS, pacing, serial};
use ladder_compile::target::CompileTarget;
use ladder_compile::{CompileOptions, CompiledProgram, compile};

/// Compiles a program for a chip; the error has all causes in one text.
fn compiled(text: &str, mcu: &str, clock_hz: u64) -> Result<CompiledProgram, String> {
    let options = CompileOptions { mcu: mcu.to_owned(), clock_hz: Some(clock_hz), ..CompileOptions::default() };
    let causes = |all: Vec<diag::Diagnostic>| all.iter().map(|d| d.cause.clone()).collect::<Vec<_>>().join("; ");
    compile(&program(text), &options).map_err(causes)
}

fn headed(cycle: u64, more: &str, rungs: &str) -> String {
    format!("LDmicro0.1\nCYCLE={cycle}\nCRYSTAL=12000000\n{more}IO LIST\nEND\nPROGRAM\n{rungs}")
}

/// Creates the chip at power-up, with random RAM content.
fn power_up(compiled: &CompiledProgram, seed: u64) -> Mcs51 {
    let chip = emu_8051::chips::chip(&compiled.map.mcu).expect("a chip");
    let image =
        emu_core::image::load_hex("image", compiled.hex.as_bytes(), chip.hex_spaces).expect("a sound image").image;
    Mcs51::new(chip, &image, RamInit::Random(seed))
}

fn run_to<P: Probe>(cpu: &mut Mcs51, at: u32, probe: &mut P) {
    cpu.set_breakpoint(at, true);
    let limit = cpu.cycle() + 200_000_000;
    while cpu.pc() != at || cpu.cycle() >= limit {
        cpu.run(limit, probe);
        assert!(cpu.cycle() < limit, "reaches {at:04x}");
    }
    cpu.set_breakpoint(at, false);
}

/// Executes the current instruction and runs until `at` is next again.
fn run_to_again(cpu: &mut Mcs51, at: u32) {
    cpu.step(&mut ());
    run_to(cpu, at, &mut ());
}

/// Clock in Hz, cycle in microseconds.
#[rustfmt::skip]
const PACED: &[(u64, u64)] = &[
    (12_000_000, 1_000), (12_000_000, 10_000), (12_000_000, 65_536), (12_000_000, 65_537), (12_000_000, 100_000),
    (11_059_200, 1_000), (11_059_200, 7_919),  (11_059_200, 10_000), (11_059_200, 131_071),
    ( 3_579_545, 5_000), ( 3_579_545, 7_919),  ( 3_579_545, 99_991), ( 3_579_545, 1_000_003),
    (    32_768, 99_991), (   32_768, 1_000_000), (   32_768, 60_000_000),
    ( 6_144_001, 12_289), ( 1_000_000, 3_333), ( 12_000_000, 1_600_000),
];

#[test]
fn scans_start_with_their_match_without_drift() {
    let rungs = "RUNG\nCONTACTS Xa 0\nTON Ta 120000000000\nCOIL Ya 0 0 0\nEND\n";
    for mcu in ["8051", "8052", "at89s52"] {
        let fast = [(20_000_000, 1_000), (20_000_000, 10_000), (33_000_000, 7_919)];
        let cases = PACED.iter().chain(fast.iter().filter(|_| mcu == "at89s52"));
        for &(clock, cycle) in cases {
            let ton = 1_000 * cycle;
            let rungs = rungs.replace("120000000000", &ton.to_string());
            let compiled = compiled(&headed(cycle, "", &rungs), mcu, clock).expect("paced");
            let map = &compiled.map;
            let mut cpu = power_up(&compiled, 1);
            run_to(&mut cpu, map.timer_start, &mut ());
            cpu.step(&mut ());
            let start = cpu.cycle();
            let mut latest = 0;
            // Run fewer scans of long cycles, because every timer round is executed.
            let scans = (30_000_000 * map.cycle.den / map.cycle.num).clamp(20, 2000);
            for k in 1..=scans {
                run_to_again(&mut cpu, map.scan_start);
                let exact = (u128::from(k) * u128::from(map.cycle.num) / u128::from(map.cycle.den)) as u64;
                let now = cpu.cycle() - start;
                assert!(
                    (exact..=exact + u64::from(map.poll_cycles)).contains(&now),
                    "{mcu}, {clock} Hz, {cycle} us: scan {k} starts at {now}, its match is at {exact}"
                );
                latest = latest.max(now - exact);
            }
            assert!(latest > 0, "{mcu}, {clock} Hz, {cycle} us: a look takes time");
        }
    }
}

#[test]
fn periods_are_planned_exactly() {
    for seed in 0..2000 {
        let mut rng = Rng::new(seed);
        let (clock, cycle) = (32_768 + rng.below(33_000_000), 1 + rng.below(3_000_000));
        let Ok(plan) = pacing::plan_pacing(clock, cycle) else { continue };
        let (turns, length) = (u128::from(plan.timer_rounds), u128::from(plan.round_cycles));
        let (rest, whole) = plan.fraction.map_or((0, 1), |f| (u128::from(f.numerator), u128::from(f.denominator)));
        assert!(rest < whole && length + u128::from(rest > 0) <= 65_536, "seed {seed}: {plan:?}");
        // Check: turns * (length + rest / whole) = clock * cycle / 12,000,000.
        let left = turns * (length * whole + rest) * 12_000_000;
        assert_eq!(left, u128::from(clock) * u128::from(cycle) * whole, "seed {seed}: {plan:?}");
    }
}

/// Collects edges of pins and sent bytes.
#[derive(Default)]
struct EdgesAndBytes {
    edges: Vec<(u64, u16, PinLevel)>,
    sent: Vec<u8>,
}

impl Probe for EdgesAndBytes {
    const EVENTS: bool = true;

    fn on_event(&mut self, event: ChipEvent) -> bool {
        match event {
            ChipEvent::Edge { at, pin, level } => self.edges.push((at.cycle, pin, level)),
            ChipEvent::Sent { byte, .. } => self.sent.push(byte),
            _ => {}
        }
        false
    }
}

#[test]
fn outputs_are_low_at_once_and_move_only_at_the_end_of_a_scan() {
    let rungs: String = (0..10).map(|n| format!("RUNG\nCONTACTS X{n} {}\nCOIL Y{n} 0 0 0\nEND\n", n & 1)).collect();
    for mcu in ["8051", "8052", "at89s52"] {
        let compiled = compiled(&headed(5_000, "", &rungs), mcu, 12_000_000).expect("compiles");
        let map = &compiled.map;
        let mut cpu = power_up(&compiled, 7);
        let chip = cpu.chip();
        let outputs: Vec<(String, u16)> = map
            .pins
            .iter()
            .filter(|pin| pin.direction == "out")
            .map(|pin| (pin.name.clone(), chip.pin(&pin.pin).expect("a pin")))
            .collect();
        let mut seen = EdgesAndBytes::default();
        run_to(&mut cpu, map.scan_start, &mut seen);
        for (name, pin) in &outputs {
            let edges: Vec<_> = seen.edges.iter().filter(|(_, p, _)| p == pin).collect();
            assert!(matches!(edges[..], [(0..=20, _, PinLevel::Low)]), "{mcu}: {name} {edges:?}");
        }
        let mut rng = Rng::new(3);
        for scan in 0..50 {
            seen = EdgesAndBytes::default();
            let bits: Vec<bool> = (0..10).map(|_| rng.one_in(2)).collect();
            // Inputs change after the previous scan and are read by this one.
            for (n, &bit) in bits.iter().enumerate() {
                let pin = map.pins.iter().find(|pin| pin.name == format!("X{n}")).expect("a pin");
                let pin = chip.pin(&pin.pin).expect("a pin");
                cpu.drive(CycleTime::at(cpu.cycle()), pin, PinLevel::from_bit(bit));
            }
            run_to(&mut cpu, map.scan_start, &mut seen);
            run_to(&mut cpu, map.rungs[0].start, &mut seen);
            // Changes of inputs within a scan must have no effect.
            for n in 0..10 {
                let pin = map.pins.iter().find(|pin| pin.name == format!("X{n}")).expect("a pin");
                let pin = chip.pin(&pin.pin).expect("a pin");
                cpu.drive(CycleTime::at(cpu.cycle()), pin, PinLevel::from_bit(rng.one_in(2)));
            }
            seen = EdgesAndBytes::default();
            let last = map.rungs.last().expect("rungs").end;
            run_to(&mut cpu, last, &mut seen);
            assert!(!seen.edges.iter().any(|(_, pin, _)| outputs.iter().any(|(_, out)| out == pin)), "scan {scan}");
            run_to(&mut cpu, map.scan_end, &mut seen);
            for (n, &bit) in bits.iter().enumerate() {
                let (_, pin) = outputs.iter().find(|(name, _)| *name == format!("Y{n}")).expect("an output");
                let wanted = PinLevel::from_bit(bit ^ (n & 1 == 1));
                assert_eq!(cpu.pin_level(*pin as _), wanted, "{mcu}, scan {scan}: Y{n}");
            }
        }
    }
}

/// Whether timer 2 generates the rate, and the machine cycles per bit as a fraction.
type BaudSource = (bool, u64, u64);

/// Clock in Hz, baud rate, and the source of the rate, if there is one.
#[rustfmt::skip]
const SPEEDS: &[(u64, u64, Option<BaudSource>)] = &[
    (11_059_200,   9600, Some((false, 96, 1))),
    (11_059_200,  19200, Some((false, 48, 1))),
    (11_059_200,  57600, Some((false, 16, 1))),
    (12_000_000,   1200, Some((false, 832, 1))),
    (12_000_000,   2400, Some((false, 416, 1))),
    (12_000_000,   4800, Some((false, 208, 1))),
    (12_000_000,   9600, Some((true, 104, 1))),
    (12_000_000,  19200, None),
    (12_000_000,  38400, None),
    (12_000_000, 115200, None),
    ( 4_000_000,   2400, Some((true, 416, 3))),
];

#[test]
fn speeds_of_the_serial_line() {
    for &(clock, baud, wanted) in SPEEDS {
        // With a long cycle, the time of a byte does not matter.
        let found = serial::plan_baud(clock, baud, 50_000, true).ok();
        if let Some((second, num, den)) = wanted {
            let found = found.unwrap_or_else(|| panic!("{clock} Hz, {baud}: there is a speed"));
            assert_eq!((found.uses_timer2, found.bit.num, found.bit.den), (second, num, den), "{clock} Hz, {baud}");
        }
        for has_timer2 in [false, true] {
            match serial::plan_baud(clock, baud, 50_000, has_timer2) {
                Ok(speed) => {
                    let real = clock as f64 / 12.0 * speed.bit.den as f64 / speed.bit.num as f64;
                    assert!((real / baud as f64 - 1.0).abs() <= 0.02, "{clock} Hz, {baud}: {real}");
                    assert!(has_timer2 || !speed.uses_timer2);
                }
                Err(nearest) => {
                    let off = nearest.abs_diff(baud) as f64 / baud as f64;
                    assert!(wanted.is_none_or(|(second, ..)| second && !has_timer2), "{clock} Hz, {baud}");
                    assert!(off > 0.019, "{clock} Hz, {baud}: {nearest} is near");
                }
            }
        }
    }
}

/// Drives a byte onto the receive pin, with the start bit at cycle `at`.
fn drive_byte(cpu: &mut Mcs51, at: u64, byte: u8, bit: (u64, u64)) {
    let pin = cpu.chip().pin("P3.0").expect("a pin");
    let bits = std::iter::once(false).chain((0..8).map(|n| byte >> n & 1 == 1)).chain([true]);
    for (n, level) in bits.enumerate() {
        cpu.drive(CycleTime::at(at + n as u64 * bit.0 / bit.1), pin, PinLevel::from_bit(level));
    }
}

#[test]
fn bytes_come_back() {
    let rungs = "RUNG\nUART_RECV a\nUART_SEND a\nCOIL Ya 0 0 0\nEND\n";
    for (mcu, clock, baud, cycle) in [
        ("8051", 11_059_200, 9_600, 2_000),
        ("8051", 12_000_000, 2_400, 5_000),
        ("8052", 12_000_000, 9_600, 2_000),
        ("8052", 11_059_200, 19_200, 1_000),
        ("at89s52", 24_000_000, 4_800, 3_000),
        // A byte takes exactly the 10 ms of a scan.
        ("at89s52", 11_059_200, 1_000, 10_000),
    ] {
        let compiled = compiled(&headed(cycle, &format!("BAUD={baud}\n"), rungs), mcu, clock)
            .unwrap_or_else(|why| panic!("{mcu}, {clock} Hz, {baud}: {why}"));
        let map = &compiled.map;
        let mut cpu = power_up(&compiled, 5);
        let mut seen = EdgesAndBytes::default();
        let mut rng = Rng::new(baud);
        let bytes: Vec<u8> = (0..30).map(|_| rng.next_u64() as u8).collect();
        run_to(&mut cpu, map.scan_start, &mut seen);
        for &byte in &bytes {
            let now = cpu.cycle();
            drive_byte(&mut cpu, now + 1 + rng.below(50), byte, (clock, 12 * baud));
            // Wait until the byte has arrived and its echo has been sent.
            for _ in 0..2 * (10_000_000u64).div_ceil(baud * cycle) + 1 {
                cpu.step(&mut seen);
                run_to(&mut cpu, map.scan_start, &mut seen);
            }
        }
        for _ in 0..20 {
            cpu.step(&mut seen);
            run_to(&mut cpu, map.scan_start, &mut seen);
        }
        assert_eq!(seen.sent, bytes, "{mcu}, {clock} Hz, {baud}");
    }
}

#[test]
fn a_byte_follows_the_one_before_as_soon_as_the_language_says() {
    // The two UART_SEND are far apart in the scan, so a byte may have to wait for the previous one.
    let slow: String = (0..12).map(|n| format!("RUNG\nDIV d{n} e f\nEND\n")).collect();
    let rungs = format!(
        "RUNG\nADD n n 1\nEND\nRUNG\nCONTACTS Xa 0\nUART_SEND n\nEND\n{slow}RUNG\nCONTACTS Xa 1\nUART_SEND n\nEND\n"
    );
    for mcu in ["8051", "8052", "at89s52"] {
        // A byte takes 9,600 cycles and the next may follow after 11,520, but the second UART_SEND runs over
        // 5,000 cycles later in its scan.
        let (clock, baud, cycle) = (11_059_200, 960, 12_500);
        let text = headed(cycle, &format!("BAUD={baud}\n"), &rungs);
        let compiled = compiled(&text, mcu, clock).unwrap_or_else(|why| panic!("{mcu}: {why}"));
        assert_eq!(compiled.listing.matches("jnb   SCON.1").count(), 2, "{mcu}: both places look at TI");
        let map = &compiled.map;
        let mut cpu = power_up(&compiled, 9);
        let mut seen = EdgesAndBytes::default();
        let mut rng = Rng::new(11);
        let xa = cpu.chip().pin(&map.pins[0].pin).expect("a pin");
        let mut wanted = Vec::new();
        let apart = 10_000_000u64.div_ceil(baud * cycle) as usize;
        run_to(&mut cpu, map.scan_start, &mut seen);
        for scan in 0..400 {
            cpu.drive(CycleTime::at(cpu.cycle()), xa, PinLevel::from_bit(rng.one_in(2)));
            if scan % apart == 0 {
                wanted.push((scan + 1) as u8);
            }
            let start = cpu.cycle();
            cpu.step(&mut seen);
            run_to(&mut cpu, map.scan_end, &mut seen);
            assert!(cpu.cycle() - start <= map.worst_scan_cycles.into(), "{mcu}: scan {scan} is too long");
            run_to(&mut cpu, map.scan_start, &mut seen);
        }
        assert!(seen.sent.len() + 2 >= wanted.len() && wanted.starts_with(&seen.sent), "{mcu}: {:?}", seen.sent);
    }
}

/// Chip, clock in Hz, cycle in microseconds, setting, rungs, and words that the refusal must contain.
type RefusalCase = (&'static str, u64, u64, &'static str, &'static str, &'static [&'static str]);

#[rustfmt::skip]
const REFUSED: &[RefusalCase] = &[
    // Longer than 255 rounds of the timer.
    ("8051",    12_000_000, 20_000_000, "",              "RUNG\nCONTACTS Xa 0\nCOIL Ya 0 0 0\nEND\n", &["20000000 us", "16711680 us"]),
    ("8052",    12_000_000,     10_000, "BAUD=115200\n", "RUNG\nUART_SEND a\nEND\n",                  &["115200", "125000"]),
    ("8051",    12_000_000,     10_000, "BAUD=9600\n",   "RUNG\nUART_SEND a\nEND\n",                  &["9600"]),
    ("at89s52", 12_000_000,     10_000, "",              "RUNG\nREAD_ADC Aa\nEND\n",                  &["READ_ADC", "at89s52"]),
    ("8052",    12_000_000,     10_000, "",              "RUNG\nSET_PWM a 1000\nEND\n",               &["SET_PWM", "8052"]),
    ("8051",    12_000_000,     10_000, "",              "RUNG\nPERSIST a\nEND\n",                    &["PERSIST", "8051"]),
];

#[test]
fn what_cannot_be_is_refused_with_figures() {
    for &(mcu, clock, cycle, more, rungs, words) in REFUSED {
        let why = compiled(&headed(cycle, more, rungs), mcu, clock).expect_err(rungs);
        assert!(words.iter().all(|word| why.contains(word)), "{mcu}: {why}");
    }
    // Too many integers, and too much code.
    let many: String = (0..70).map(|n| format!("RUNG\nMOVE v{n} 1\nEND\n")).collect();
    let why = compiled(&headed(10_000, "", &many), "8051", 12_000_000).expect_err("too many integers");
    assert!(why.contains("140") && why.contains("128"), "{why}");
    assert!(compiled(&headed(10_000, "", &many), "8052", 12_000_000).is_ok());
    // Every written value is read before it is overwritten, so the optimiser removes nothing.
    let long: String = (0..500).map(|n| format!("RUNG\nMUL v{} v{} v2\nEND\n", n % 9, (n + 1) % 9)).collect();
    let why = compiled(&headed(50_000, "", &long), "8051", 12_000_000).expect_err("too much code");
    assert!(why.contains("4096"), "{why}");
}

#[test]
fn outputs_on_port_0_are_warned_of() {
    let rungs = "RUNG\nCONTACTS Xa 0\nCOIL Ya 0 0 0\nEND\nRUNG\nCONTACTS Xa 1\nCOIL Yb 0 0 0\nEND\n";
    let options = |pin: &str| CompileOptions {
        mcu: "8051".to_owned(),
        pins: vec![ladder_compile::PinAssignment::new("Ya", pin)],
        ..CompileOptions::default()
    };
    let program = program(&headed(10_000, "", rungs));
    for (pin, warned) in [("P0.3", true), ("P2.3", false)] {
        let compiled = compile(&program, &options(pin)).expect("compiles");
        let is_noted = compiled.notes.iter().any(|note| note.cause.contains("P0.3"));
        let warnings: Vec<_> = compiled.notes.iter().filter(|note| note.cause.contains("never high")).collect();
        assert_eq!((is_noted && warnings.len() == 1, warnings.len()), (warned, usize::from(warned)), "{pin}");
    }
}

/// The chips of the back end with their properties.
#[test]
fn targets_are_rows_of_the_chips() {
    let names: Vec<&str> = TARGETS.iter().map(|target: &CompileTarget| target.chip.name).collect();
    assert_eq!(names, ["8051", "8052", "at89s52"]);
    for target in TARGETS {
        assert_eq!(target.pins.len(), 32);
        assert!(target.pins.iter().all(|pin| target.chip.pin(pin).is_some()));
    }
}
