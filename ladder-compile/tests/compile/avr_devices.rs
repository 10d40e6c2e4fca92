//! Peripherals and limits of the AVR chips: what the PWM pin does, tables below 64 KB, refusals with their figures.

use crate::common::bench::{Bench, pins};
use emu_avr::{Avr, Options};
use emu_core::{Cpu, Level, RamInit};
use ladder::{ElementId, SymbolKind};
use ladder_compile::avr::TARGETS;
use ladder_compile::ir::{BitCell, BitRole, Ir, Op, RungCode, Step, Table, UartUse, Value, Word, WordCell, WordRole};
use ladder_compile::target::{Job, Mark, Refusal, Target};
use ladder_compile::{Place, Special};

/// Integers `v0`, `v1`, .. and one rung.
fn program(words: u32, ops: Vec<Op>) -> Ir {
    let cell =
        |n| WordCell { name: format!("v{n}"), role: WordRole::Symbol(SymbolKind::Variable), bytes: 2, initial: 0 };
    let steps = ops.into_iter().map(|op| Step { at: ElementId { rung: 0, index: 0 }, op }).collect();
    Ir { words: (0..words).map(cell).collect(), rungs: vec![RungCode { elements: 1, steps }], ..Ir::default() }
}

fn target(name: &str) -> &'static Target {
    TARGETS.iter().find(|target| target.chip.name == name).expect("a target")
}

fn machine(chip: &'static emu_core::Chip, built: &ladder_compile::target::Built, hz: u64) -> Avr {
    let segments: Vec<(u32, &[u8])> = built.segments.iter().map(|(at, bytes)| (*at, &bytes[..])).collect();
    let hex = emu_core::image::write_hex(&segments);
    let image = emu_core::image::load_hex("image", hex.as_bytes(), chip.hex).expect("a sound image").image;
    Avr::with(chip, &image, RamInit::Random(5), Options::at(hz))
}

fn run_to(cpu: &mut Avr, at: u32) {
    cpu.trap(at, true);
    cpu.run(cpu.cycle() + 10_000_000, &mut ());
    assert_eq!(cpu.pc(), at);
    cpu.trap(at, false);
}

/// The high share of a period at the pin is the duty within one step; 0 and 100 percent are constant, and so is the time before
/// the first duty.
const PERIODS: u64 = 16;

#[test]
fn the_pwm_pin_has_its_duty() {
    // Fast and phase correct.
    for (hertz, period, steps) in [(3_906, 2_048, 256), (1_960, 4_080, 255)] {
        for target in TARGETS {
            let name = target.chip.name;
            let mut ir = program(1, vec![Op::SetPwm { duty: Value::Cell(Word(0)) }]);
            ir.pwm_hz = Some(hertz);
            let bench = Bench { target, clock_hz: 8_000_000, cycle_us: 2_000, baud: None };
            let built = bench.build(&ir).expect("builds");
            let [Special::Pwm { period: found, steps: found_steps, .. }] = &built.specials[..] else {
                panic!("{name}: one special pin");
            };
            assert_eq!((found.num / found.den, *found_steps), (period, steps), "{name}");
            let mut cpu = machine(target.chip, &built, bench.clock_hz);
            let pin = target.chip.pin(target.pwm.expect("a PWM pin")).expect("a pin");
            let at = |mark| built.marks.iter().find(|(m, _)| *m == mark).expect("a mark").1;
            run_to(&mut cpu, at(Mark::Poll));
            assert_eq!(cpu.level(pin), Level::Low, "{name} before the first duty");
            for duty in [0, 1, 2, 37, 50, 98, 99, 100, 101, 30_000, -1, -32_768, 100, 0] {
                run_to(&mut cpu, at(Mark::ScanStart));
                let Place::Word { space, addr, .. } = &built.words[0] else { panic!("a word") };
                for (n, byte) in (duty as i16).to_le_bytes().into_iter().enumerate() {
                    assert!(cpu.poke(space, addr + n as u32, byte));
                }
                run_to(&mut cpu, at(Mark::ScanEnd));
                // A new duty begins with the next period. Scans with the same duty go on meanwhile.
                cpu.run(cpu.cycle() + 2 * period, &mut ());
                let (start, mut high) = (cpu.cycle(), 0);
                while cpu.cycle() < start + PERIODS * period {
                    let before = cpu.cycle();
                    cpu.step(&mut ());
                    high += if cpu.level(pin) == Level::High { cpu.cycle() - before } else { 0 };
                }
                let all = cpu.cycle() - start;
                let wanted = u64::try_from(duty.clamp(0, 100)).expect("a share") * all / 100;
                if wanted == 0 || wanted == all {
                    assert_eq!(high, wanted, "{name}: duty {duty}");
                } else {
                    // One step, one period that is cut off, and the two clocks of an instruction at each edge.
                    let off = all / u64::from(steps) + period / PERIODS + 4 * PERIODS;
                    assert!(high.abs_diff(wanted) <= off, "{name}: duty {duty}: {high} of {all}, wanted {wanted}");
                }
            }
        }
    }
}

/// More code than LPM reaches: the table still is where it reaches.
#[test]
fn tables_lie_low() {
    let table = Table { name: "t".to_owned(), bytes: 2, values: vec![5, -6, 700] };
    let mut ops = vec![Op::Lookup { dst: Word(0), index: Word(1), table: 0 }];
    for n in 0..15_000 {
        ops.push(Op::Math {
            op: ladder_compile::ir::Math::Add,
            dst: Word(2),
            a: Value::Cell(Word(3)),
            b: Value::Const(1000 + n % 7),
        });
    }
    let mut ir = program(4, ops);
    ir.tables.push(table);
    ir.words[1].initial = 2;
    let bench = Bench { target: target("atmega128"), clock_hz: 16_000_000, cycle_us: 20_000, baud: None };
    let built = bench.build(&ir).expect("builds");
    assert!(built.segments[0].1.len() > 0x1_0000);
    let mut cpu = machine(bench.target.chip, &built, bench.clock_hz);
    let at = |mark| built.marks.iter().find(|(m, _)| *m == mark).expect("a mark").1;
    run_to(&mut cpu, at(Mark::ScanEnd));
    let Place::Word { space, addr, .. } = &built.words[0] else { panic!("a word") };
    let bytes = [0, 1].map(|n| cpu.peek(space, addr + n).expect("a byte"));
    assert_eq!(i16::from_le_bytes(bytes), 700);
}

#[test]
fn what_does_not_fit_is_refused_with_the_figures() {
    let bench = |name| Bench { target: target(name), clock_hz: 4_000_000, cycle_us: 10_000, baud: None };
    // Code: every chip says what it has.
    let sum =
        Op::Math { op: ladder_compile::ir::Math::Add, dst: Word(0), a: Value::Cell(Word(1)), b: Value::Cell(Word(2)) };
    for target in TARGETS {
        let long = program(3, vec![sum.clone(); target.chip.flash as usize / 6 + 100]);
        let bench = Bench { target, ..bench("atmega8") };
        let Err(Refusal::Code { needed, available, rungs }) = bench.build(&long) else {
            panic!("{}: refused by its code", target.chip.name)
        };
        assert_eq!(available, u64::from(target.chip.flash));
        assert!(needed > available && rungs.len() == 1 && rungs[0] <= needed && rungs[0] + 200 > needed);
    }
    let many = program(600, Vec::new());
    let Err(Refusal::Ram { needed, available: 512 }) = bench("atmega48").build(&many) else { panic!("refused by RAM") };
    assert!((1_150..=1_202).contains(&needed), "{needed}");

    let job = |cycle_us, clock_hz| Bench { cycle_us, clock_hz, ..bench("atmega328p") }.build(&program(0, Vec::new()));
    assert_eq!(job(16_777_217, 4_000_000), Err(Refusal::Period { shortest: 1, longest: 16_777_216 }));

    // 4 MHz / 8 / 4 is 125,000, 8 % off 115,200.
    let mut serial = program(1, vec![Op::Send { value: Value::Cell(Word(0)) }]);
    serial.uart = UartUse { send: true, receive: false };
    let fast = Bench { baud: Some(115_200), ..bench("atmega16") };
    assert_eq!(fast.build(&serial).err(), Some(Refusal::Baud { nearest: 125_000 }));

    let mut pwm = program(1, vec![Op::SetPwm { duty: Value::Const(3) }]);
    pwm.pwm_hz = Some(10_000);
    assert_eq!(bench("atmega32").build(&pwm).err(), Some(Refusal::Pwm { nearest: 7_843 }));
}

/// Pins of the debugging interface are taken from it by two writes in a row; others leave it alone.
#[test]
fn the_debugging_interface_gives_up_its_pins() {
    for (name, control) in [("atmega16", "0x34"), ("atmega64", "0x34"), ("atmega162", "0x34")] {
        let target = target(name);
        for (outputs, wanted) in [(3, 0), (target.pins.len() as u32, 2)] {
            let cell = |n| BitCell { name: format!("Y{n:02}"), role: BitRole::Output };
            let ir = Ir { bits: (0..outputs).map(cell).collect(), ..program(0, Vec::new()) };
            let pins = pins(&ir, target);
            let job = Job { ir: &ir, target, pins: &pins, clock_hz: 4_000_000, cycle_us: 10_000, baud: None };
            let built = (target.build)(&job).expect("builds");
            let writes = |line: &&ladder_compile::target::Line| {
                line.text.split_whitespace().eq(["out", &format!("{control},"), "r24"])
            };
            assert_eq!(built.lines.iter().filter(writes).count(), wanted, "{name} with {outputs} outputs");
        }
    }
}
