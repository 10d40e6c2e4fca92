//! Random intermediate code as C and as byte code: every operation at every width does what its documentation
//! says.

use emu_check::via::script::{ScanRecord, ServeScript, SlotNumbering};
use emu_check::via::serve::{ServedForm, run_interpreted, run_native, run_on_chip};
use emu_core::rng::Rng;
use emu_test_support::random_seed;
use ladder_compile::emit::{EmittedSource, bytecode, c};
use ladder_compile::ir::{BitRole, Ir, WordRole};

use crate::ir::interp::{IrInterpreter, boundary_value};
use crate::ir::programs::{IrLimits, ops, random_ir};

const ALL: u32 = ops::INTEGERS | ops::LOGIC | ops::ADC | ops::PWM | ops::SEND | ops::RECEIVE | ops::EEPROM;

/// The properties of the programs, used in rotation.
const WISHES: [IrLimits; 5] = [
    IrLimits::BITS,
    IrLimits::WORDS,
    IrLimits::WIDTHS,
    IrLimits { ops: ALL, adcs: 3, byte_scans: 2, eeprom_scans: 3, ..IrLimits::WIDTHS },
    IrLimits { bits: 60, words: 30, rungs: 10, steps: 20, depth: 4, ops: ALL, adcs: 1, ..IrLimits::WIDTHS },
];

/// Returns a program without rungs, as the name of code that has no ladder program.
fn nameless() -> ladder::LadderProgram {
    let text = "LDmicro0.1\nCYCLE=1000\nCRYSTAL=1000000\nBAUD=9600\nIO LIST\nEND\nPROGRAM\n";
    ladder::parse("random", text).unwrap_or_else(|e| panic!("{e:?}")).program
}

/// Returns a script of `scans` scans, and the results of the interpreter of the intermediate code.
fn script(
    ir: &Ir,
    source: &EmittedSource,
    slots: SlotNumbering,
    seed: u64,
    scans: u32,
) -> (ServeScript, Vec<ScanRecord>) {
    let shape = slots.record_shape(source);
    let mut rng = Rng::new(seed ^ 0x5C21);
    let (mut script, mut wanted) = (ServeScript::new(), Vec::new());
    let lasting: Vec<usize> = (0..ir.bits.len()).filter(|&n| ir.bits[n].role != BitRole::Temporary).collect();
    let integers: Vec<usize> = (0..ir.words.len()).filter(|&n| ir.words[n].role != WordRole::Temporary).collect();
    let of = |role| lasting.iter().copied().filter(move |&n| ir.bits[n].role == role);
    let mut model = IrInterpreter::new(ir);
    for scan in 0..scans {
        if scan % 40 == 0 {
            script.reset(rng.next_u64() as u8);
            model = IrInterpreter::new(ir);
        }
        for (bit, n) in of(BitRole::Input).zip(0..) {
            model.bits[bit] = rng.one_in(2);
            script.input(n, model.bits[bit]);
        }
        for n in 0..ir.adcs.len() {
            model.adc[n] = if rng.one_in(3) { 1023 } else { rng.below(1024) as u16 };
            script.analog(n as u16, model.adc[n]);
        }
        if model.received.is_none() && rng.one_in(3) {
            let byte = rng.next_u64() as u8;
            model.received = Some(byte);
            script.receive(byte);
        }
        for cell in 0..ir.eeprom_bytes {
            if rng.one_in(20) {
                let byte = rng.next_u64() as u8;
                model.eeprom[usize::from(cell)] = byte;
                script.eeprom_cell(cell, byte);
            }
        }
        // The source declares the cells in this order: persistent bits, then persistent integers.
        for (n, slot) in shape.cells.iter().enumerate() {
            if !rng.one_in(3) {
                continue;
            }
            match n.checked_sub(lasting.len()) {
                None if ir.bits[lasting[n]].role != BitRole::Input => {
                    model.bits[lasting[n]] = rng.one_in(2);
                    script.write(*slot, model.bits[lasting[n]].into());
                }
                None => {}
                Some(n) if matches!(ir.words[integers[n]].role, WordRole::Symbol(_)) => {
                    let value = boundary_value(&mut rng, ir.words[integers[n]].bytes);
                    model.words[integers[n]] = value;
                    script.write(*slot, value);
                }
                Some(_) => {}
            }
        }
        model.sent.clear();
        model.scan();
        script.scan();
        let bits = lasting.iter().map(|&n| i32::from(model.bits[n]));
        wanted.push(ScanRecord {
            cells: bits.chain(integers.iter().map(|&n| model.words[n])).collect(),
            outputs: of(BitRole::Output).map(|n| model.bits[n]).collect(),
            sent: (model.sent.len() as u8, model.sent.last().copied().unwrap_or(0)),
            duty: model.duties.get(&0).copied(),
            buses: 0,
            eeprom: model.eeprom.clone(),
        });
    }
    (script, wanted)
}

struct Case {
    seed: u64,
    ir: Ir,
}

/// Returns `count` programs; EMU_SEED shifts their seeds.
fn cases(count: u64) -> Vec<Case> {
    let first = random_seed() * 1000;
    let wish = |seed: u64| WISHES[(seed % WISHES.len() as u64) as usize];
    (first..first + count).map(|seed| Case { seed, ir: random_ir(&mut Rng::new(seed), wish(seed)) }).collect()
}

fn compare(case: &Case, source: &EmittedSource, found: &[ScanRecord], wanted: &[ScanRecord]) {
    assert_eq!(found.len(), wanted.len(), "seed {}", case.seed);
    for (scan, (found, wanted)) in found.iter().zip(wanted).enumerate() {
        let differing = source.cells.iter().zip(found.cells.iter().zip(&wanted.cells)).filter(|(_, (f, w))| f != w);
        let differing: Vec<String> =
            differing.map(|(cell, (f, w))| format!("{} is {f}, wanted {w}", cell.name)).collect();
        assert!(found == wanted, "seed {}, scan {scan}: {differing:?}\n{found:?}\n{wanted:?}\n{}", case.seed, case.ir);
    }
}

fn both(
    emit: fn(&ladder::LadderProgram, &Ir) -> EmittedSource,
    slots: SlotNumbering,
    run: impl Fn(&[(EmittedSource, ServeScript)]) -> Vec<Vec<ScanRecord>>,
) {
    let cases = cases(60);
    let mut wanted = Vec::new();
    let mut programs = Vec::new();
    for case in &cases {
        let source = emit(&nameless(), &case.ir);
        let (script, records) = script(&case.ir, &source, slots, case.seed, 120);
        wanted.push(records);
        programs.push((source, script));
    }
    let found = run(&programs);
    assert_eq!(found.len(), cases.len());
    for (((case, (source, _)), found), wanted) in cases.iter().zip(&programs).zip(&found).zip(&wanted) {
        compare(case, source, found, wanted);
    }
}

#[test]
#[ignore = "needs gcc: .ci/peers installs it"]
fn random_code_does_the_same_in_c() {
    for portable in [false, true] {
        both(c::emit_ir, SlotNumbering::InOrder, |programs| {
            run_native(programs, portable).unwrap_or_else(|e| panic!("{e}"))
        });
    }
}

#[test]
#[ignore = "needs gcc: .ci/peers installs it"]
fn random_code_does_the_same_as_byte_code() {
    both(bytecode::emit_ir, SlotNumbering::Interpreter, |programs| {
        run_interpreted(programs).unwrap_or_else(|e| panic!("{e}"))
    });
}

fn on(mcu: &str, form: ServedForm, cases: Vec<Case>) {
    for case in cases {
        let (source, slots) = match form {
            ServedForm::C => (c::emit_ir(&nameless(), &case.ir), SlotNumbering::InOrder),
            ServedForm::Bytecode => (bytecode::emit_ir(&nameless(), &case.ir), SlotNumbering::Interpreter),
        };
        let (script, wanted) = script(&case.ir, &source, slots, case.seed, 80);
        let found = run_on_chip(&source, &script, form, mcu).unwrap_or_else(|e| panic!("seed {}: {e}", case.seed));
        compare(&case, &source, &found, &wanted);
    }
}

#[test]
#[ignore = "needs avr-gcc: .ci/peers installs it"]
fn random_code_does_the_same_in_c_on_an_avr() {
    on("atmega328p", ServedForm::C, cases(25));
}

#[test]
#[ignore = "needs avr-gcc: .ci/peers installs it"]
fn random_code_does_the_same_as_byte_code_on_an_avr() {
    on("atmega328p", ServedForm::Bytecode, cases(25));
}

#[test]
#[ignore = "needs sdcc: .ci/peers installs it"]
fn random_code_does_the_same_in_c_on_an_8051() {
    // SDCC takes minutes for the large ones.
    let small = cases(15).into_iter().filter(|case| case.seed % WISHES.len() as u64 != 4);
    on("8051", ServedForm::C, small.collect());
}
