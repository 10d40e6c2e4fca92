//! Tests PIC16 images of random ladder programs on the emulated chips against the interpreter.
//!
//! The programs have few names, deep branches and mostly edge-triggered elements, so that formulas stay
//! pending across conditionally executed code.

use crate::common::bench::{ImageBench, RunFailure};
use emu_core::rng::Rng;
use emu_pic16::Pic16;
use ladder_compile::lower::lower;
use ladder_compile::optimise::optimise;
use ladder_compile::target::BuildRefusal;

const CHIPS: &[&str] = &["pic16f873", "pic16f877a", "pic16f628", "pic16f88"];

#[test]
fn deep_branches_with_edges() {
    let mut held = 0;
    for seed in 0..120 {
        let text = ladder(&mut Rng::new(seed));
        let ir = optimise(lower(&crate::common::program(&text)));
        let chip = CHIPS[seed as usize % CHIPS.len()];
        let target = ladder_compile::find_target(chip).expect("a target");
        let bench = ImageBench { target, clock_hz: 4_000_000, cycle_us: 50_000, baud: Some(2400) };
        match bench.run(&ir, seed, 30, Pic16::new) {
            Ok(_) => held += 1,
            Err(RunFailure::Refused(refusal @ BuildRefusal::CodeTooLarge { .. })) => {
                println!("{chip}, seed {seed}: {refusal:?}")
            }
            Err(how) => panic!("{chip}, seed {seed}: {how}\n{text}"),
        }
    }
    assert!(held > 80, "{held} programs are held");
}

/// Generates one to three rungs with integers of any width.
fn ladder(rng: &mut Rng) -> String {
    let mut out = "LDmicro0.2\nCYCLE=10000\nCRYSTAL=4000000\nBAUD=2400\nIO LIST\nEND\nVAR LIST\n".to_owned();
    for name in ["n", "m", "Ca", "Cb", "s0", "s1", "s2"] {
        // A counter must hold its limits.
        let least = if name.starts_with('C') { 2 } else { 1 };
        if rng.one_in(2) {
            out += &format!("  {} bytes {name}\n", least + rng.below(5 - least));
        }
    }
    out += "END\nPROGRAM\n";
    for _ in 0..1 + rng.below(3) {
        out += &format!("RUNG\n{}", series(rng, 0));
        out += if rng.one_in(2) { "COIL Yb 0 0 0\nEND\n" } else { "END\n" };
    }
    out
}

fn series(rng: &mut Rng, depth: u32) -> String {
    let mut out = String::new();
    for _ in 0..1 + rng.below(4) {
        if depth < 3 && rng.one_in(3) {
            out += "PARALLEL\n";
            for _ in 0..2 + rng.below(2) {
                let inner = series(rng, depth + 1);
                out += &if inner.lines().count() == 1 { inner } else { format!("SERIES\n{inner}END\n") };
            }
            out += "END\n";
        } else {
            out += &format!("{}\n", element(rng));
        }
    }
    out
}

fn element(rng: &mut Rng) -> String {
    let mut pick = |from: &[&'static str]| from[rng.below(from.len() as u64) as usize];
    let kind = pick(&[
        "contact", "contact", "contact", "edge", "counter", "counter", "timer", "compare", "coil", "math", "other",
    ]);
    match kind {
        "contact" => format!("CONTACTS {} {}", pick(&["Xa", "Xb", "Ya", "Yb", "Ra", "Rb"]), pick(&["0", "1"])),
        "edge" => pick(&["OSR", "OSF"]).to_owned(),
        "counter" => {
            let (is, name, max) =
                (pick(&["CTU", "CTD", "CTC"]), pick(&["Ca", "Cb"]), pick(&["0", "1", "127", "-255", "32766", "n"]));
            format!("{is} {name} {max} {} {}", pick(&["0", "5", "-3"]), pick(&["/", "\\", "-", "o"]))
        }
        "timer" => {
            format!("{} {} {}", pick(&["TON", "TOF", "RTO"]), pick(&["Ta", "Tb"]), pick(&["20000", "30000"]))
        }
        "compare" => {
            let rel = pick(&["EQU", "NEQ", "LES", "GEQ", "GRT", "LEQ"]);
            format!("{rel} {} {}", pick(&["n", "m", "Ca", "0", "-1", "127"]), pick(&["n", "m", "Cb", "0", "-1", "256"]))
        }
        "coil" => format!("COIL {} {}", pick(&["Ya", "Ra", "Rb"]), pick(&["0 0 0", "1 0 0", "0 1 0", "0 0 1"])),
        "math" => pick(&["ADD n m 1", "MOVE m n", "DIV n m 3", "MUL m n Ca", "SUB Ca n m"]).to_owned(),
        _ => pick(&[
            "UART_RECV n",
            "SHIFT_REGISTER s 3",
            "RES Ca",
            "RES Ta",
            "MASTER_RELAY",
            "SHORT",
            "OPEN",
            "LOOK_UP_TABLE m n 4 0 5 6 7 8",
            "LOOK_UP_TABLE m Ca 4 0 5 6 7 8",
        ])
        .to_owned(),
    }
}
