//! Compares the evaluator with traces of LDmicro 2.3, if the corpus is present.
//!
//! The corpus is in the folder `EMU_CORPUS`, by default `../shared/ld` next to the workspace. The columns of
//! inputs (X) are set; every other column must match.

use crate::common;
use std::fs;
use std::path::{Path, PathBuf};

use ladder::LadderProgram;

/// Programs with traces in the corpus.
const TRACED: &[&str] = &[
    "reg-contacts",
    "reg-integers",
    "reg-timers-counters",
    "sample-blink",
    "sample-coil_s_r_n",
    "sample-ctc_osr",
    "sample-traffic",
];

/// Programs without traces, which only have to run: LDmicro traces no sent bytes, PWM or EEPROM.
const UNTRACED: &[&str] = &[
    "sample-7seg-display",
    "sample-MasterRelay-Test",
    "sample-ctu_ctd_ctc",
    "reg-avr-hw",
    "reg-pic16-hw",
    "reg-misc-ops",
    "sample-pic-adc",
    "sample-hello",
    "sample-frmt_escape",
];

#[test]
fn traces_of_ldmicro_come_out_column_by_column() {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/ld");
    let folder = std::env::var_os("EMU_CORPUS").map_or_else(beside, PathBuf::from);
    if !folder.is_dir() {
        println!("skipped: no corpus at {}; EMU_CORPUS names its folder", folder.display());
        return;
    }
    for name in TRACED {
        trace(&folder, name);
    }
    for name in UNTRACED {
        let mut eval = common::evaluator(&program(&folder, name));
        (0..1000).for_each(|_| eval.scan());
        assert_eq!(eval.scans(), 1000, "{name}");
    }
}

fn read(path: PathBuf) -> String {
    fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn program(folder: &Path, name: &str) -> LadderProgram {
    common::parse(name, &read(folder.join(format!("{name}.ld"))))
}

fn trace(folder: &Path, name: &str) {
    let program = program(folder, name);
    let csv = read(folder.join("traces").join(format!("{name}.csv")));
    let mut eval = common::evaluator(&program);
    let mut lines = csv.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    assert_eq!(header[0], "scan", "{name}");
    let columns: Vec<usize> = header[1..].iter().map(|n| common::index(&eval, n)).collect();
    for (i, symbol) in eval.symbols().iter().enumerate() {
        assert!(columns.contains(&i), "{name}: no column for {}", symbol.name);
    }
    let mut scans = 0;
    for line in lines {
        let values: Vec<i32> = line.split(',').map(|v| v.parse().expect("a number")).collect();
        let row = &values[1..];
        for (&symbol, &value) in columns.iter().zip(row) {
            if eval.symbols()[symbol].name.starts_with('X') {
                eval.set(symbol, value);
            }
        }
        eval.scan();
        scans += 1;
        assert_eq!(values[0], scans, "{name}: scans are numbered from 1");
        let found: Vec<i32> = columns.iter().map(|&symbol| eval.get(symbol)).collect();
        assert_eq!(found, row, "{name}, scan {scans}, columns {:?}", &header[1..]);
    }
    assert_eq!(scans, 800, "{name}");
}
