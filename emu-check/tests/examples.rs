//! Every example of the project agrees with its image on the chip, with everything covered that can be.

mod common;

use emu_check::Options;

#[test]
fn examples_agree() {
    for path in common::examples() {
        let program = common::read(&path);
        let report = common::report(&program, &Options::default());
        println!("{}", report.text());
        assert!(report.agreed && report.coverage.full, "{}", report.text());
    }
}
