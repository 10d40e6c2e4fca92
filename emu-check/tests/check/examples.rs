//! The examples of the project and the programs of this folder agree with their images on the chip, with full
//! coverage of all possible outcomes. The corpus has a separate test.

use crate::common;
use emu_check::CheckOptions;

#[test]
fn examples_agree() {
    let folder = common::folder("../examples");
    for path in folder.into_iter().chain(common::folder("tests/programs")) {
        let program = common::read(&path);
        let report = common::report(&program, &CheckOptions::default());
        println!("{}", report.text());
        assert!(report.agreed && report.coverage.full, "{}", report.text());
    }
}
