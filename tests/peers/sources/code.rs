//! Random intermediate code as C and as byte code: every operation at every width does what its documents say.

use emu_check::via::script::{Record, Script, Slots};
use emu_check::via::serve::{Form, interpreted, native, on_chip};
use emu_core::rng::Rng;
use ladder_compile::emit::{Source, bytecode, c};
use ladder_compile::ir::{BitRole, Ir, WordRole};

use crate::ir::interp::{Machine, boundary};
use crate::ir::programs::{Wish, ops, random};

const ALL: u32 = ops::INTEGERS | ops::LOGIC | ops::ADC | ops::PWM | ops::SEND | ops::RECEIVE | ops::EEPROM;

/// What the programs are like, in turn.
const WISHES: [Wish; 5] = [
    Wish::BITS,
    Wish::WORDS,
    Wish::WIDTHS,
    Wish { ops: ALL, adcs: 3, byte_scans: 2, eeprom_scans: 3, ..Wish::WIDTHS },
    Wish { bits: 60, words: 30, rungs: 10, steps: 20, depth: 4, ops: ALL, adcs: 1, ..Wish::WIDTHS },
];

/// A program without rungs, which gives its name to code that comes from no program.
fn nameless() -> ladder::Program {
    let text = "LDmicro0.1\nCYCLE=1000\nCRYSTAL=1000000\nBAUD=9600\nIO LIST\nEND\nPROGRAM\n";
    ladder::parse("random", text).unwrap_or_else(|e| panic!("{e:?}")).program
}

/// A script of so many scans, and what the interpreter of the intermediate code says to it.
fn script(ir: &Ir, source: &Source, slots: Slots, seed: u64, scans: u32) -> (Script, Vec<Record>) {
    let shape = slots.shape(source);
    let mut rng = Rng::new(seed ^ 0x5C21);
    let (mut script, mut wanted) = (Script::new(), Vec::new());
    let lasting: Vec<usize> = (0..ir.bits.len()).filter(|&n| ir.bits[n].role != BitRole::Temporary).collect();
    let integers: Vec<usize> = (0..ir.words.len()).filter(|&n| ir.words[n].role != WordRole::Temporary).collect();
    let of = |role| lasting.iter().copied().filter(move |&n| ir.bits[n].role == role);
    let mut model = Machine::new(ir);
    for scan in 0..scans {
        if scan % 40 == 0 {
            script.reset(rng.next_u64() as u8);
            model = Machine::new(ir);
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
        for cell in 0..ir.eeprom {
            if rng.one_in(20) {
                let byte = rng.next_u64() as u8;
                model.eeprom[usize::from(cell)] = byte;
                script.cell(cell, byte);
            }
        }
        // Cells stand in the source as they are listed here: bits that last, then integers that last.
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
                    let value = boundary(&mut rng, ir.words[integers[n]].bytes);
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
        wanted.push(Record {
            cells: bits.chain(integers.iter().map(|&n| model.words[n])).collect(),
            outputs: of(BitRole::Output).map(|n| model.bits[n]).collect(),
            sent: (model.sent.len() as u8, model.sent.last().copied().unwrap_or(0)),
            duty: model.duty,
            eeprom: model.eeprom.clone(),
        });
    }
    (script, wanted)
}

struct Case {
    seed: u64,
    ir: Ir,
}

/// So many programs; EMU_SEED moves where their seeds begin.
fn cases(count: u64) -> Vec<Case> {
    let first = crate::seed() * 1000;
    let wish = |seed: u64| WISHES[(seed % WISHES.len() as u64) as usize];
    (first..first + count).map(|seed| Case { seed, ir: random(&mut Rng::new(seed), wish(seed)) }).collect()
}

fn compare(case: &Case, source: &Source, found: &[Record], wanted: &[Record]) {
    assert_eq!(found.len(), wanted.len(), "seed {}", case.seed);
    for (scan, (found, wanted)) in found.iter().zip(wanted).enumerate() {
        let differing = source.cells.iter().zip(found.cells.iter().zip(&wanted.cells)).filter(|(_, (f, w))| f != w);
        let differing: Vec<String> =
            differing.map(|(cell, (f, w))| format!("{} is {f}, wanted {w}", cell.name)).collect();
        assert!(found == wanted, "seed {}, scan {scan}: {differing:?}\n{found:?}\n{wanted:?}\n{}", case.seed, case.ir);
    }
}

fn both(
    emit: fn(&ladder::Program, &Ir) -> Source,
    slots: Slots,
    run: impl Fn(&[(Source, Script)]) -> Vec<Vec<Record>>,
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
        both(c::from_ir, Slots::InOrder, |programs| native(programs, portable).unwrap_or_else(|e| panic!("{e}")));
    }
}

#[test]
#[ignore = "needs gcc: .ci/peers installs it"]
fn random_code_does_the_same_as_byte_code() {
    both(bytecode::from_ir, Slots::Interpreter, |programs| interpreted(programs).unwrap_or_else(|e| panic!("{e}")));
}

fn on(mcu: &str, form: Form, cases: Vec<Case>) {
    for case in cases {
        let (source, slots) = match form {
            Form::C => (c::from_ir(&nameless(), &case.ir), Slots::InOrder),
            Form::Bytecode => (bytecode::from_ir(&nameless(), &case.ir), Slots::Interpreter),
        };
        let (script, wanted) = script(&case.ir, &source, slots, case.seed, 80);
        let found = on_chip(&source, &script, form, mcu).unwrap_or_else(|e| panic!("seed {}: {e}", case.seed));
        compare(&case, &source, &found, &wanted);
    }
}

#[test]
#[ignore = "needs avr-gcc: .ci/peers installs it"]
fn random_code_does_the_same_in_c_on_an_avr() {
    on("atmega328p", Form::C, cases(25));
}

#[test]
#[ignore = "needs avr-gcc: .ci/peers installs it"]
fn random_code_does_the_same_as_byte_code_on_an_avr() {
    on("atmega328p", Form::Bytecode, cases(25));
}

#[test]
#[ignore = "needs sdcc: .ci/peers installs it"]
fn random_code_does_the_same_in_c_on_an_8051() {
    // SDCC takes minutes for the large ones.
    let small = cases(15).into_iter().filter(|case| case.seed % WISHES.len() as u64 != 4);
    on("8051", Form::C, small.collect());
}
