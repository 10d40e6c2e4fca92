//! Addresses of registers, pins and interrupts (user's manual, "Special function registers"; AT89S52 data
//! sheet, table 1).

/// Direct addresses.
#[rustfmt::skip]
#[allow(missing_docs)]
pub mod sfr {
    pub const P0:     u8 = 0x80;
    pub const SP:     u8 = 0x81;
    pub const DPL:    u8 = 0x82;
    pub const DPH:    u8 = 0x83;
    pub const DP1L:   u8 = 0x84;
    pub const DP1H:   u8 = 0x85;
    pub const PCON:   u8 = 0x87;
    pub const TCON:   u8 = 0x88;
    pub const TMOD:   u8 = 0x89;
    pub const TL0:    u8 = 0x8A;
    pub const TL1:    u8 = 0x8B;
    pub const TH0:    u8 = 0x8C;
    pub const TH1:    u8 = 0x8D;
    pub const AUXR:   u8 = 0x8E;
    pub const P1:     u8 = 0x90;
    pub const SCON:   u8 = 0x98;
    pub const SBUF:   u8 = 0x99;
    pub const P2:     u8 = 0xA0;
    pub const AUXR1:  u8 = 0xA2;
    pub const WDTRST: u8 = 0xA6;
    pub const IE:     u8 = 0xA8;
    pub const P3:     u8 = 0xB0;
    pub const IP:     u8 = 0xB8;
    pub const T2CON:  u8 = 0xC8;
    pub const T2MOD:  u8 = 0xC9;
    pub const RCAP2L: u8 = 0xCA;
    pub const RCAP2H: u8 = 0xCB;
    pub const TL2:    u8 = 0xCC;
    pub const TH2:    u8 = 0xCD;
    pub const PSW:    u8 = 0xD0;
    pub const ACC:    u8 = 0xE0;
    pub const B:      u8 = 0xF0;
}

/// Pins by their position in the list of a chip: port times 8 plus bit.
#[rustfmt::skip]
#[allow(missing_docs)]
pub mod pin {
    use emu_core::pins::PinId;
    pub const T2:   PinId = 8;
    pub const T2EX: PinId = 9;
    pub const RXD:  PinId = 24;
    pub const TXD:  PinId = 25;
    pub const INT0: PinId = 26;
    pub const INT1: PinId = 27;
    pub const T0:   PinId = 28;
    pub const T1:   PinId = 29;
    pub const WR:   PinId = 30;
    /// Output of the comparator, on chips that have one.
    pub const OUT:  PinId = 30;
    pub const RD:   PinId = 31;
    pub const RST:  PinId = 32;
}

/// Interrupt sources by number. The number gives the polling order ("Priority within level"), and is the bit
/// in IE and IP plus 1.
#[rustfmt::skip]
#[allow(missing_docs)]
pub mod irq {
    pub const INT0:   u8 = 1;
    pub const TIMER0: u8 = 2;
    pub const INT1:   u8 = 3;
    pub const TIMER1: u8 = 4;
    pub const SERIAL: u8 = 5;
    pub const TIMER2: u8 = 6;
}
