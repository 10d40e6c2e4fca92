//! Tests the named constants of the chips. `tests/headers.rs` compares them with the headers of gputils.

use emu_core::NamedConstant;
use std::collections::BTreeMap;

use emu_pic16::chips::{PIC16_PARTS, part};

/// Samples of each kind: chip, name, value in hexadecimal or `-`; from the registers in the data sheets named
/// in `src/chips`.
const SOME: &str = "
    pic16f873   W               0
    pic16f873   F               1
    pic16f873   RP0             5
    pic16f873   NOT_TO          4
    pic16f873   TMR1            0E
    pic16f873   _CONFIG         2007
    pic16f873   _XT_OSC         3FFD
    pic16f873   _RC_OSC         3FFF
    pic16f873   _EXTRC_CLKOUT   -
    pic16f873   _WDT_OFF        3FFB
    pic16f873   _PWRTE_ON       3FF7
    pic16c84    _PWRTE_ON       3FFF
    pic16f873   _CP_ALL         0FCF
    pic16f873   _CP_HALF        1FDF
    pic16f873   _CP_UPPER_256   2FEF
    pic16f870   _CP_HALF        -
    pic16f628   _CP_50          2BFF
    pic16f628   _CP_75          17FF
    pic16f628a  _CP_50          -
    pic16f628   _ER_OSC_CLKOUT  3FFF
    pic16f628   _RC_OSC         -
    pic16f628   _INTRC_OSC_NOCLKOUT 3FFC
    pic16f873   _WRT_ENABLE_OFF 3DFF
    pic16f873a  _WRT_OFF        3FFF
    pic16f873a  _WRT_1FOURTH    3BFF
    pic16f873a  _WRT_ON         -
    pic16f818   _WRT_1024       3BFF
    pic16f819   _WRT_1536       39FF
    pic16f88    _WRT_ALL        39FF
    pic16f870   _WRT_ALL        3FFF
    pic16f88    _CCP1_RB3       2FFF
    pic16f88    _CONFIG2        2008
    pic16f88    _IESO_OFF       3FFD
    pic16f873   _IESO_OFF       -
    pic16f84    _DEBUG_ON       -
    pic16f873   _DEBUG_ON       37FF
    pic16c84    _DEVID1         -
    pic16c84    _IDLOC3         2003
";

#[test]
fn some_names_and_their_values() {
    for line in SOME.lines().filter(|line| !line.trim().is_empty()) {
        let &[chip, name, value] = &line.split_whitespace().collect::<Vec<_>>()[..] else { panic!("{line}") };
        let all = (part(chip).expect("a chip").chip.constants)();
        let ours = all.iter().find(|row| row.name == name).map(|row| row.value);
        let wanted = (value != "-").then(|| i32::from_str_radix(value, 16).expect("a number"));
        assert_eq!(ours, wanted, "{line}");
    }
}

/// No name has two meanings, and none is the name of a register.
#[test]
fn names_are_clear() {
    for part in PIC16_PARTS {
        let all = (part.chip.constants)();
        let once: BTreeMap<_, _> = all.iter().map(|one| (one.name, one.value)).collect();
        assert!(all.len() > 50, "{}: {} names", part.chip.name, all.len());
        for NamedConstant { name, value } in all {
            assert_eq!(once.get(name), Some(&value), "{}: {name}", part.chip.name);
            assert!(!part.chip.regs.iter().any(|reg| reg.name == name), "{}: {name}", part.chip.name);
        }
    }
}
