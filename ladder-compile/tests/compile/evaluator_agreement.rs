//! Compares the two definitions of every element: interpreted intermediate code must agree with the evaluator
//! after each scan.
//!
//! The code is tested before and after optimisation, and as three-address code.

use std::collections::BTreeSet;

use crate::common::ir::interp::IrInterpreter;
use crate::common::ir::interp::boundary_value;
use crate::common::ladders::{LEFT_OUT, random_ladder};
use emu_core::rng::Rng;
use ladder::{LadderProgram, ProgramElement};
use ladder_compile::ir::{Ir, IrOp};
use ladder_compile::lower::{lower, to_three_address};
use ladder_compile::optimise::optimise;
use ladder_eval::Evaluator;

#[test]
fn random_programs_mean_the_same() {
    let mut accepted = 0;
    for seed in 0..500 {
        let mut rng = Rng::new(seed);
        let text = random_ladder(&mut rng, seed % 2 == 1);
        let program = crate::common::program(&text);
        // Elements after one that must be last (LD102) are still defined.
        if ladder::check(&program).iter().any(|reported| reported.is_error() && reported.code != "LD102") {
            continue;
        }
        accepted += 1;
        let simple = lower(&program);
        for (form, ir) in
            [("plain", to_three_address(simple.clone())), ("optimised", optimise(simple.clone())), ("simple", simple)]
        {
            if let Err(how) = agree(&program, &ir, seed) {
                panic!("seed {seed}, {form}: {how}\n{text}\n{ir}");
            }
        }
    }
    assert!(accepted > 450, "{accepted} programs are accepted");
}

#[test]
fn random_programs_have_every_element() {
    let mut found = BTreeSet::new();
    for seed in 0..500 {
        let text = random_ladder(&mut Rng::new(seed), seed % 2 == 1);
        found.extend(
            crate::common::program(&text).elements().map(|ProgramElement { element, .. }| element.facts().keyword),
        );
    }
    let missing: Vec<&str> = ladder::element_keywords().filter(|keyword| !found.contains(keyword)).collect();
    assert_eq!(missing, LEFT_OUT.iter().map(|row| row.0).collect::<Vec<_>>(), "missing, and left out with a reason");
}

/// Runs both sides for some scans.
fn agree(program: &LadderProgram, ir: &Ir, seed: u64) -> Result<(), String> {
    let mut rng = Rng::new(seed ^ 0xA5);
    let mut eval = Evaluator::new(program).map_err(|e| e.to_string())?;
    let mut machine = IrInterpreter::new(ir);
    let symbols = eval.symbols().to_vec();
    for scan in 1..=40 {
        for (n, symbol) in symbols.iter().enumerate() {
            let input = symbol.kind == ladder::SymbolKind::Input;
            if !input && !rng.one_in(6) {
                continue;
            }
            let value = if symbol.kind.is_bit() { rng.below(2) as i32 } else { boundary_value(&mut rng, symbol.bytes) };
            eval.set(n, value);
            match ir.bits.iter().position(|cell| cell.name == symbol.name) {
                Some(bit) => machine.bits[bit] = value != 0,
                None => {
                    let word =
                        ir.words.iter().position(|cell| cell.name == symbol.name).ok_or("a symbol without a cell")?;
                    machine.words[word] = value;
                }
            }
        }
        for (n, name) in ir.adcs.iter().enumerate() {
            machine.adc[n] = rng.below(1024) as u16;
            let symbol = eval.index(name).ok_or("an analog symbol")?;
            eval.set_adc(symbol, machine.adc[n]);
        }
        if rng.one_in(3) && ir.uart.receive && !eval.has_received_byte() {
            let byte = rng.next_u64() as u8;
            assert!(eval.receive(byte));
            machine.received = Some(byte);
        }
        machine.sent.clear();
        eval.scan();
        machine.scan();
        for (n, symbol) in symbols.iter().enumerate() {
            let found = match ir.bits.iter().position(|cell| cell.name == symbol.name) {
                Some(bit) => i32::from(machine.bits[bit]),
                None => machine.words[ir.words.iter().position(|cell| cell.name == symbol.name).ok_or("a cell")?],
            };
            if found != eval.get(n) {
                return Err(format!("scan {scan}: {} is {found}, wanted {}", symbol.name, eval.get(n)));
            }
        }
        let sent = eval.sent_bytes().to_vec();
        let wrong =
            |what: &str, found: &str, wanted: &str| Err(format!("scan {scan}: {what} {found}, wanted {wanted}"));
        if machine.sent != sent {
            return wrong("sent", &format!("{:?}", machine.sent), &format!("{sent:?}"));
        }
        let duties: Vec<Option<u8>> =
            (0..).zip(eval.pwm_outputs()).map(|(output, _)| machine.duties.get(&output).copied()).collect();
        if duties != eval.pwm_duties() {
            return wrong("duties", &format!("{duties:?}"), &format!("{:?}", eval.pwm_duties()));
        }
        if machine.eeprom != eval.eeprom() {
            return wrong("EEPROM", &format!("{:?}", machine.eeprom), &format!("{:?}", eval.eeprom()));
        }
        // With UART_RECV_AVAIL, the code takes a byte from the receiver at the start of a scan and keeps it.
        let kept = ir.bits.iter().position(|cell| cell.name == "byte waits").is_some_and(|bit| machine.bits[bit]);
        let waits = machine.received.is_some() || kept;
        if waits != eval.has_received_byte() {
            return wrong("waiting", &waits.to_string(), &eval.has_received_byte().to_string());
        }
    }
    Ok(())
}

/// Three-address code uses the accumulator only where an operation of the chip itself sets it.
#[test]
fn plain_code_has_no_accumulator() {
    for seed in 0..200 {
        let mut rng = Rng::new(seed);
        let text = random_ladder(&mut rng, false);
        let program = crate::common::program(&text);
        let ir = to_three_address(lower(&program));
        for step in ir.rungs.iter().flat_map(|rung| &rung.steps) {
            none(&step.op, seed);
        }
    }
}

fn none(op: &IrOp, seed: u64) {
    match op {
        IrOp::SetAccumulator(_)
        | IrOp::Load { .. }
        | IrOp::And { .. }
        | IrOp::Or { .. }
        | IrOp::Rising(_)
        | IrOp::Falling(_)
        | IrOp::AndCompare(_) => {
            panic!("seed {seed}: {op:?}")
        }
        IrOp::If { if_true: then, if_false: otherwise, .. } => {
            then.iter().chain(otherwise).for_each(|op| none(op, seed))
        }
        _ => {}
    }
}
