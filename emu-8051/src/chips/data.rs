//! Registers, bits and pins in groups, from which the rows of the chips are assembled.

use emu_core::chip::{NamedAddress, NamedConstant, PinDef};

/// Rows of [`NamedAddress`]: address and name.
macro_rules! rows {
    ($($addr:literal $name:literal)*) => { &[ $( NamedAddress { name: $name, addr: $addr } ),* ] };
}

/// Registers that every chip has (manual, "Special function registers").
#[rustfmt::skip]
pub(super) const REGS: &[NamedAddress] = rows! {
    0x81 "SP"   0x82 "DPL"  0x83 "DPH"  0x87 "PCON" 0x88 "TCON" 0x89 "TMOD" 0x8A "TL0"  0x8B "TL1"  0x8C "TH0"
    0x8D "TH1"  0x90 "P1"   0x98 "SCON" 0x99 "SBUF" 0xA8 "IE"   0xB0 "P3"   0xB8 "IP"   0xD0 "PSW"  0xE0 "ACC"
    0xF0 "B"
};

/// Ports of the chips with 40 pins.
pub(super) const REGS_BUS: &[NamedAddress] = rows! { 0x80 "P0" 0xA0 "P2" };

/// Timer 2 of the 8052.
pub(super) const REGS_TIMER2: &[NamedAddress] =
    rows! { 0xC8 "T2CON" 0xCA "RCAP2L" 0xCB "RCAP2H" 0xCC "TL2" 0xCD "TH2" };

/// The register of a timer 2 that can count down and output a clock (AT89C52, "Timer 2 registers").
pub(super) const REGS_T2MOD: &[NamedAddress] = rows! { 0xC9 "T2MOD" };

/// Registers that the AT89S parts add. DP0 is the new name of the original data pointer (AT89S52, table 5-1).
#[rustfmt::skip]
pub(super) const REGS_AT89S: &[NamedAddress] = rows! {
    0x82 "DP0L" 0x83 "DP0H" 0x84 "DP1L" 0x85 "DP1H" 0x8E "AUXR" 0xA2 "AUXR1" 0xA6 "WDTRST"
};

/// Bits that every chip has. A bit without a data-sheet name is named by its register and number.
#[rustfmt::skip]
pub(super) const BITS: &[NamedAddress] = rows! {
    0x88 "IT0"   0x89 "IE0"   0x8A "IT1"   0x8B "IE1"   0x8C "TR0"   0x8D "TF0"   0x8E "TR1"   0x8F "TF1"
    0x90 "P1.0"  0x91 "P1.1"  0x92 "P1.2"  0x93 "P1.3"  0x94 "P1.4"  0x95 "P1.5"  0x96 "P1.6"  0x97 "P1.7"
    0x98 "RI"    0x99 "TI"    0x9A "RB8"   0x9B "TB8"   0x9C "REN"   0x9D "SM2"   0x9E "SM1"   0x9F "SM0"
    0xA8 "EX0"   0xA9 "ET0"   0xAA "EX1"   0xAB "ET1"   0xAC "ES"                 0xAE "IE.6"  0xAF "EA"
    0xB0 "P3.0"  0xB1 "P3.1"  0xB2 "P3.2"  0xB3 "P3.3"  0xB4 "P3.4"  0xB5 "P3.5"  0xB6 "P3.6"  0xB7 "P3.7"
    0xB8 "PX0"   0xB9 "PT0"   0xBA "PX1"   0xBB "PT1"   0xBC "PS"                 0xBE "IP.6"  0xBF "IP.7"
    0xD0 "P"     0xD1 "PSW.1" 0xD2 "OV"    0xD3 "RS0"   0xD4 "RS1"   0xD5 "F0"    0xD6 "AC"    0xD7 "CY"
    0xE0 "ACC.0" 0xE1 "ACC.1" 0xE2 "ACC.2" 0xE3 "ACC.3" 0xE4 "ACC.4" 0xE5 "ACC.5" 0xE6 "ACC.6" 0xE7 "ACC.7"
    0xF0 "B.0"   0xF1 "B.1"   0xF2 "B.2"   0xF3 "B.3"   0xF4 "B.4"   0xF5 "B.5"   0xF6 "B.6"   0xF7 "B.7"
};

/// Port bits that only chips with 40 pins have.
#[rustfmt::skip]
pub(super) const BITS_BUS: &[NamedAddress] = rows! {
    0x80 "P0.0" 0x81 "P0.1" 0x82 "P0.2" 0x83 "P0.3" 0x84 "P0.4" 0x85 "P0.5" 0x86 "P0.6" 0x87 "P0.7"
    0xA0 "P2.0" 0xA1 "P2.1" 0xA2 "P2.2" 0xA3 "P2.3" 0xA4 "P2.4" 0xA5 "P2.5" 0xA6 "P2.6" 0xA7 "P2.7"
};

/// Bits of timer 2. The names C/T2 and CP/RL2 are written with `_` in place of the slash, as compilers do.
#[rustfmt::skip]
pub(super) const BITS_TIMER2: &[NamedAddress] = rows! {
    0xAD "ET2" 0xBD "PT2"
    0xC8 "CP_RL2" 0xC9 "C_T2" 0xCA "TR2" 0xCB "EXEN2" 0xCC "TCLK" 0xCD "RCLK" 0xCE "EXF2" 0xCF "TF2"
};

/// Names of the bits of IE and IP that timer 2 would use.
pub(super) const BITS_NO_TIMER2: &[NamedAddress] = rows! { 0xAD "IE.5" 0xBD "IP.5" };

/// Alternative functions of the pins of port 3, as names of their bits (manual, "Port structures and
/// operation").
#[rustfmt::skip]
pub(super) const PORT_3: &[NamedConstant] =
    &[constant("RXD", 0xB0), constant("TXD", 0xB1), constant("INT0", 0xB2), constant("INT1", 0xB3), constant("T0", 0xB4), constant("T1", 0xB5)];

/// Alternative functions of port 3 on chips with an external bus.
pub(super) const PORT_3_BUS: &[NamedConstant] = &[constant("WR", 0xB6), constant("RD", 0xB7)];

/// Pins of timer 2, and its bits with a slash in the spelling of sdas8051.
pub(super) const PORT_1_TIMER2: &[NamedConstant] =
    &[constant("T2", 0x90), constant("T2EX", 0x91), constant("CPRL2", 0xC8), constant("CT2", 0xC9)];

/// Makes a constant of a header.
const fn constant(name: &'static str, value: i32) -> NamedConstant {
    NamedConstant { name, value }
}

/// Merges groups into one list sorted by address; at equal addresses, earlier groups come first.
macro_rules! regs {
    ($($group:expr),+) => { &$crate::chips::data::merge::<{ 0 $(+ $group.len())+ }>(&[$($group),+]) };
}
pub(super) use regs;

/// See [`regs`]; `N` is the total length of all groups.
pub(super) const fn merge<const N: usize>(groups: &[&[NamedAddress]]) -> [NamedAddress; N] {
    let mut all = [NamedAddress { name: "", addr: 0 }; N];
    let (mut len, mut g) = (0, 0);
    while g < groups.len() {
        let mut i = 0;
        while i < groups[g].len() {
            let mut at = len;
            while at > 0 && all[at - 1].addr > groups[g][i].addr {
                all[at] = all[at - 1];
                at -= 1;
            }
            all[at] = groups[g][i];
            len += 1;
            i += 1;
        }
        g += 1;
    }
    all
}

/// Pins: name, number on the package, other function.
macro_rules! pins {
    ($($name:literal $dip:literal $note:literal)*) => {
        &[ $( emu_core::chip::PinDef { name: $name, dip: $dip, note: $note } ),* ]
    };
}
pub(super) use pins;

/// Pins of the chips with 40 pins (manual, "Pin descriptions"). The chips differ in the alternative functions
/// of port 1.
macro_rules! dip40 {
    ($a:literal $b:literal $c:literal $d:literal $e:literal $f:literal $g:literal $h:literal) => {
        $crate::chips::data::pins! {
            "P0.0" 39 "AD0" "P0.1" 38 "AD1" "P0.2" 37 "AD2" "P0.3" 36 "AD3"
            "P0.4" 35 "AD4" "P0.5" 34 "AD5" "P0.6" 33 "AD6" "P0.7" 32 "AD7"
            "P1.0" 1 $a "P1.1" 2 $b "P1.2" 3 $c "P1.3" 4 $d "P1.4" 5 $e "P1.5" 6 $f "P1.6" 7 $g "P1.7" 8 $h
            "P2.0" 21 "A8" "P2.1" 22 "A9" "P2.2" 23 "A10" "P2.3" 24 "A11"
            "P2.4" 25 "A12" "P2.5" 26 "A13" "P2.6" 27 "A14" "P2.7" 28 "A15"
            "P3.0" 10 "RXD" "P3.1" 11 "TXD" "P3.2" 12 "INT0" "P3.3" 13 "INT1"
            "P3.4" 14 "T0" "P3.5" 15 "T1" "P3.6" 16 "WR" "P3.7" 17 "RD"
            "RST" 9 "reset"
        }
    };
}
pub(super) use dip40;

/// Pins of the AT89C2051 and AT89C4051 (data sheets, "Pin configuration").
#[rustfmt::skip]
pub(super) const DIP20: &[PinDef] = pins! {
    "P0.0" 0 "absent" "P0.1" 0 "absent" "P0.2" 0 "absent" "P0.3" 0 "absent"
    "P0.4" 0 "absent" "P0.5" 0 "absent" "P0.6" 0 "absent" "P0.7" 0 "absent"
    "P1.0" 12 "AIN0" "P1.1" 13 "AIN1" "P1.2" 14 "" "P1.3" 15 "" "P1.4" 16 "" "P1.5" 17 "" "P1.6" 18 "" "P1.7" 19 ""
    "P2.0" 0 "absent" "P2.1" 0 "absent" "P2.2" 0 "absent" "P2.3" 0 "absent"
    "P2.4" 0 "absent" "P2.5" 0 "absent" "P2.6" 0 "absent" "P2.7" 0 "absent"
    "P3.0" 2 "RXD" "P3.1" 3 "TXD" "P3.2" 6 "INT0" "P3.3" 7 "INT1"
    "P3.4" 8 "T0" "P3.5" 9 "T1" "P3.6" 0 "comparator output" "P3.7" 11 ""
    "RST" 1 "reset"
};
