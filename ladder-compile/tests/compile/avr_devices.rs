//! Tests peripherals and limits of the AVR chips: the PWM pin, tables below 64 KB, refusals with numbers.

use crate::common::bench::{ImageBench, pins};
use crate::common::ir::programs::pwm_output;
use emu_avr::{Avr, Options};
use emu_core::{Cpu, PinLevel, RamInit};
use ladder::{ElementId, SymbolKind};
use ladder_compile::avr::TARGETS;
use ladder_compile::ir::{
    BitCell, BitRole, ConstantTable, Ir, IrOp, IrStep, RungCode, UartUse, WordCell, WordId, WordOperand, WordRole,
};
use ladder_compile::target::{BuildRefusal, CodeMark, CompileJob, CompileTarget};
use ladder_compile::{CellLocation, SpecialPin};

/// Creates a program with integers `v0`, `v1`, .. and one rung.
fn program(words: u32, ops: Vec<IrOp>) -> Ir {
    let cell =
        |n| WordCell { name: format!("v{n}"), role: WordRole::Symbol(SymbolKind::Variable), bytes: 2, initial: 0 };
    let steps = ops.into_iter().map(|op| IrStep { element: ElementId { rung: 0, index: 0 }, op }).collect();
    Ir { words: (0..words).map(cell).collect(), rungs: vec![RungCode { element_count: 1, steps }], ..Ir::default() }
}

fn target(name: &str) -> &'static CompileTarget {
    TARGETS.iter().find(|target| target.chip.name == name).expect("a target")
}

fn machine(chip: &'static emu_core::Chip, built: &ladder_compile::target::BuiltImage, hz: u64) -> Avr {
    let segments: Vec<_> =
        built.segments.iter().map(|(at, bytes)| emu_core::image::HexSegment { addr: *at, bytes }).collect();
    let hex = emu_core::image::write_hex(&segments);
    let image = emu_core::image::load_hex("image", hex.as_bytes(), chip.hex_spaces).expect("a sound image").image;
    Avr::with(chip, &image, RamInit::Random(5), Options::at_hz(hz))
}

fn run_to(cpu: &mut Avr, at: u32) {
    cpu.set_breakpoint(at, true);
    cpu.run(cpu.cycle() + 10_000_000, &mut ());
    assert_eq!(cpu.pc(), at);
    cpu.set_breakpoint(at, false);
}

/// Number of PWM periods to measure.
///
/// The high share at the pin must be the duty cycle within one step. 0 and 100 percent are constant, as is
/// the pin before the first SET_PWM.
const PERIODS: u64 = 16;

#[test]
fn the_pwm_pin_has_its_duty() {
    // Fast and phase-correct PWM.
    for (hertz, period, steps) in [(3_906, 2_048, 256), (1_960, 4_080, 255)] {
        for target in TARGETS {
            let name = target.chip.name;
            let mut ir = program(1, vec![IrOp::SetPwm { output: 0, duty: WordOperand::Cell(WordId(0)) }]);
            ir.pwms = vec![pwm_output(hertz)];
            let bench = ImageBench { target, clock_hz: 8_000_000, cycle_us: 2_000, baud: None };
            let built = bench.build(&ir).expect("builds");
            let [SpecialPin::Pwm { period: found, steps: found_steps, .. }] = &built.specials[..] else {
                panic!("{name}: one special pin");
            };
            assert_eq!((found.num / found.den, *found_steps), (period, steps), "{name}");
            let mut cpu = machine(target.chip, &built, bench.clock_hz);
            let pin = target.chip.pin(target.pwm[0].pin).expect("a pin");
            let at = |mark| built.marks.iter().find(|(m, _)| *m == mark).expect("a mark").1;
            run_to(&mut cpu, at(CodeMark::PollLoop));
            assert_eq!(cpu.pin_level(pin), PinLevel::Low, "{name} before the first duty");
            for duty in [0, 1, 2, 37, 50, 98, 99, 100, 101, 30_000, -1, -32_768, 100, 0] {
                run_to(&mut cpu, at(CodeMark::ScanStart));
                let CellLocation::Word { space, addr, .. } = &built.word_places[0] else { panic!("a word") };
                for (n, byte) in (duty as i16).to_le_bytes().into_iter().enumerate() {
                    assert!(cpu.poke(space, addr + n as u32, byte));
                }
                run_to(&mut cpu, at(CodeMark::ScanEnd));
                // A new duty cycle starts with the next period; meanwhile scans continue with the same duty
                // cycle.
                cpu.run(cpu.cycle() + 2 * period, &mut ());
                let (start, mut high) = (cpu.cycle(), 0);
                while cpu.cycle() < start + PERIODS * period {
                    let before = cpu.cycle();
                    cpu.step(&mut ());
                    high += if cpu.pin_level(pin) == PinLevel::High { cpu.cycle() - before } else { 0 };
                }
                let all = cpu.cycle() - start;
                let wanted = u64::try_from(duty.clamp(0, 100)).expect("a share") * all / 100;
                if wanted == 0 || wanted == all {
                    assert_eq!(high, wanted, "{name}: duty {duty}");
                } else {
                    // Tolerance: one step, one truncated period, and the two clocks of an instruction at each
                    // edge.
                    let off = all / u64::from(steps) + period / PERIODS + 4 * PERIODS;
                    assert!(high.abs_diff(wanted) <= off, "{name}: duty {duty}: {high} of {all}, wanted {wanted}");
                }
            }
        }
    }
}

/// With more code than LPM reaches, tables must still be within its reach.
#[test]
fn tables_lie_low() {
    let table = ConstantTable { name: "t".to_owned(), bytes: 2, values: vec![5, -6, 700] };
    let mut ops = vec![IrOp::Lookup { dst: WordId(0), index: WordId(1), table: 0 }];
    for n in 0..15_000 {
        ops.push(IrOp::Math {
            op: ladder_compile::ir::ArithmeticOp::Add,
            dst: WordId(2),
            a: WordOperand::Cell(WordId(3)),
            b: WordOperand::Const(1000 + n % 7),
        });
    }
    let mut ir = program(4, ops);
    ir.tables.push(table);
    ir.words[1].initial = 2;
    let bench = ImageBench { target: target("atmega128"), clock_hz: 16_000_000, cycle_us: 20_000, baud: None };
    let built = bench.build(&ir).expect("builds");
    assert!(built.segments[0].1.len() > 0x1_0000);
    let mut cpu = machine(bench.target.chip, &built, bench.clock_hz);
    let at = |mark| built.marks.iter().find(|(m, _)| *m == mark).expect("a mark").1;
    run_to(&mut cpu, at(CodeMark::ScanEnd));
    let CellLocation::Word { space, addr, .. } = &built.word_places[0] else { panic!("a word") };
    let bytes = [0, 1].map(|n| cpu.peek(space, addr + n).expect("a byte"));
    assert_eq!(i16::from_le_bytes(bytes), 700);
}

#[test]
fn what_does_not_fit_is_refused_with_the_figures() {
    let bench = |name| ImageBench { target: target(name), clock_hz: 4_000_000, cycle_us: 10_000, baud: None };
    // Code: for every chip, the refusal states its program memory.
    let sum = IrOp::Math {
        op: ladder_compile::ir::ArithmeticOp::Add,
        dst: WordId(0),
        a: WordOperand::Cell(WordId(1)),
        b: WordOperand::Cell(WordId(2)),
    };
    for target in TARGETS {
        let long = program(3, vec![sum.clone(); target.chip.flash_bytes as usize / 6 + 100]);
        let bench = ImageBench { target, ..bench("atmega8") };
        let Err(BuildRefusal::CodeTooLarge { needed, available, rungs }) = bench.build(&long) else {
            panic!("{}: refused by its code", target.chip.name)
        };
        assert_eq!(available, u64::from(target.chip.flash_bytes));
        assert!(needed > available && rungs.len() == 1 && rungs[0] <= needed && rungs[0] + 200 > needed);
    }
    let many = program(600, Vec::new());
    let Err(BuildRefusal::RamTooSmall { needed, available: 512 }) = bench("atmega48").build(&many) else {
        panic!("refused by RAM")
    };
    assert!((1_150..=1_202).contains(&needed), "{needed}");

    let job =
        |cycle_us, clock_hz| ImageBench { cycle_us, clock_hz, ..bench("atmega328p") }.build(&program(0, Vec::new()));
    assert_eq!(job(16_777_217, 4_000_000), Err(BuildRefusal::PeriodOutOfRange { shortest: 1, longest: 16_777_216 }));

    // 4 MHz / 8 / 4 is 125,000, which is 8 % off 115,200.
    let mut serial = program(1, vec![IrOp::Send { value: WordOperand::Cell(WordId(0)) }]);
    serial.uart = UartUse { send: true, ..UartUse::default() };
    let fast = ImageBench { baud: Some(115_200), ..bench("atmega16") };
    assert_eq!(fast.build(&serial).err(), Some(BuildRefusal::BaudOutOfRange { nearest: 125_000 }));

    let mut pwm = program(1, vec![IrOp::SetPwm { output: 0, duty: WordOperand::Const(3) }]);
    pwm.pwms = vec![pwm_output(10_000)];
    assert_eq!(
        bench("atmega32").build(&pwm).err(),
        Some(BuildRefusal::PwmOutOfRange { hertz: 10_000, nearest: 7_843 })
    );
}

/// JTAG pins in use are freed by two consecutive writes; otherwise the interface stays on.
#[test]
fn the_debugging_interface_gives_up_its_pins() {
    for (name, control) in [("atmega16", "0x34"), ("atmega64", "0x34"), ("atmega162", "0x34"), ("atmega644", "0x35")] {
        let target = target(name);
        for (outputs, wanted) in [(3, 0), (target.pins.len() as u32, 2)] {
            let cell = |n| BitCell { name: format!("Y{n:02}"), role: BitRole::Output, initial: false };
            let ir = Ir { bits: (0..outputs).map(cell).collect(), ..program(0, Vec::new()) };
            let pins = pins(&ir, target);
            let job = CompileJob {
                ir: &ir,
                target,
                pins: &pins,
                pwm_pins: &[],
                clock_hz: 4_000_000,
                cycle_us: 10_000,
                baud: None,
            };
            let built = (target.build)(&job).expect("builds");
            let writes = |line: &&ladder_compile::target::ImageLine| {
                line.text.split_whitespace().eq(["out", &format!("{control},"), "r24"])
            };
            assert_eq!(built.lines.iter().filter(writes).count(), wanted, "{name} with {outputs} outputs");
        }
    }
}
