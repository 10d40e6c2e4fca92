//! Measures the time of a scan of a small realistic program.
//!
//! Run it with `cargo test -p plcemu-ladder-eval --test eval -- --nocapture speed`. The test asserts the
//! state after a million scans, but no time.

use crate::common;
use std::time::Instant;

const CROSSING: &str = "\
RUNG
    CONTACTS Rclock 1
    TOF Toff 500000
    TON Ton 500000
    COIL Rclock 0 0 0
END
RUNG
    CONTACTS Rclock 0
    CTC Cphase 9
END
RUNG
    LES Cphase 6
    COIL Yred 0 0 0
END
RUNG
    GEQ Cphase 6
    LES Cphase 8
    PARALLEL
        COIL Ygreen 0 0 0
        COIL Rasked 0 0 1
    END
END
RUNG
    GEQ Cphase 8
    COIL Yyellow 0 0 0
END
RUNG
    PARALLEL
        CONTACTS Xleft 1
        CONTACTS Xright 1
    END
    COIL Rasked 0 1 0
END
";

#[test]
fn a_million_scans() {
    const SCANS: u64 = 1_000_000;
    let mut eval = common::evaluator(&common::rungs(CROSSING));
    let start = Instant::now();
    for _ in 0..SCANS {
        eval.scan();
    }
    println!("{:.0} ns a scan", start.elapsed().as_nanos() as f64 / SCANS as f64);
    assert_eq!(eval.scans(), SCANS);
    let lights = ["Yred", "Ygreen", "Yyellow"].map(|n| eval.get(common::index(&eval, n)));
    assert_eq!(lights.iter().sum::<i32>(), 1, "one light at a time: {lights:?}");
}
