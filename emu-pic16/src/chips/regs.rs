//! Registers in data memory and interrupt flags, in groups from which each chip row takes its own (data
//! sheets, "Register file map", and the sections of the peripherals).

use super::FlagLocation;
use crate::chips::SfrBitPlace;
use crate::periph::map::{InterruptFlag, Sfr};

/// Rows of address and register.
macro_rules! sfrs {
    ($($addr:literal $reg:ident)*) => { &[ $( ($addr, Sfr::$reg) ),* ] };
}

/// Registers in banks 0 and 1 of every chip.
#[rustfmt::skip]
pub(super) const CORE: &[(u16, Sfr)] = sfrs! {
    0x00 INDF 0x01 TMR0   0x02 PCL 0x03 STATUS 0x04 FSR 0x05 PORTA 0x06 PORTB 0x0A PCLATH 0x0B INTCON
    0x80 INDF 0x81 OPTION 0x82 PCL 0x83 STATUS 0x84 FSR 0x85 TRISA 0x86 TRISB 0x8A PCLATH 0x8B INTCON
};

/// Registers in banks 2 and 3 of chips with four banks.
#[rustfmt::skip]
pub(super) const CORE_HIGH: &[(u16, Sfr)] = sfrs! {
    0x100 INDF 0x101 TMR0   0x102 PCL 0x103 STATUS 0x104 FSR 0x106 PORTB 0x10A PCLATH 0x10B INTCON
    0x180 INDF 0x181 OPTION 0x182 PCL 0x183 STATUS 0x184 FSR 0x186 TRISB 0x18A PCLATH 0x18B INTCON
};

/// Registers of port C.
pub(super) const PORT_C: &[(u16, Sfr)] = sfrs! { 0x07 PORTC 0x87 TRISC };

/// Registers of ports D and E.
pub(super) const PORT_DE: &[(u16, Sfr)] = sfrs! { 0x08 PORTD 0x09 PORTE 0x88 TRISD 0x89 TRISE };

/// Registers of timers 1 and 2 and CCP1, and the first peripheral interrupt registers, which only chips with
/// timers have.
#[rustfmt::skip]
pub(super) const TIMERS: &[(u16, Sfr)] = sfrs! {
    0x0C PIR1 0x0E TMR1L 0x0F TMR1H 0x10 T1CON 0x11 TMR2 0x12 T2CON 0x15 CCPR1L 0x16 CCPR1H 0x17 CCP1CON
    0x8C PIE1 0x8E PCON 0x92 PR2
};

/// Registers of CCP2.
pub(super) const CCP2: &[(u16, Sfr)] = sfrs! { 0x1B CCPR2L 0x1C CCPR2H 0x1D CCP2CON };

/// Registers of the synchronous serial port.
pub(super) const SSP: &[(u16, Sfr)] = sfrs! { 0x13 SSPBUF 0x14 SSPCON 0x93 SSPADD 0x94 SSPSTAT };

/// Additional register of the MSSP.
pub(super) const MSSP: &[(u16, Sfr)] = sfrs! { 0x91 SSPCON2 };

/// Registers of the USART.
pub(super) const USART: &[(u16, Sfr)] = sfrs! { 0x18 RCSTA 0x19 TXREG 0x1A RCREG 0x98 TXSTA 0x99 SPBRG };

/// Registers of a 10-bit converter.
pub(super) const ADC: &[(u16, Sfr)] = sfrs! { 0x1E ADRESH 0x1F ADCON0 0x9E ADRESL 0x9F ADCON1 };

/// Registers of the 8-bit converter: ADRES is accessible in both banks (16C71, figure 4-5).
pub(super) const ADC_71: &[(u16, Sfr)] = sfrs! { 0x08 ADCON0 0x09 ADRESH 0x88 ADCON1 0x89 ADRESH };

/// Registers of the comparators and their reference.
pub(super) const COMPARATORS: &[(u16, Sfr)] = sfrs! { 0x9C CMCON 0x9D CVRCON };

/// Registers of the comparators and their reference on the 16F62x.
pub(super) const COMPARATORS_62X: &[(u16, Sfr)] = sfrs! { 0x1F CMCON 0x9F CVRCON };

/// EEPROM registers of the 16F84.
pub(super) const EEPROM_84: &[(u16, Sfr)] = sfrs! { 0x08 EEDATA 0x09 EEADR 0x88 EECON1 0x89 EECON2 };

/// EEPROM registers of the 16F62x.
pub(super) const EEPROM_62X: &[(u16, Sfr)] = sfrs! { 0x9A EEDATA 0x9B EEADR 0x9C EECON1 0x9D EECON2 };

/// Registers of EEPROM and program memory, and the second peripheral interrupt registers, which only these
/// chips have.
#[rustfmt::skip]
pub(super) const FLASH: &[(u16, Sfr)] = sfrs! {
    0x0D PIR2 0x8D PIE2 0x10C EEDATA 0x10D EEADR 0x10E EEDATH 0x10F EEADRH 0x18C EECON1 0x18D EECON2
};

/// Registers of an internal oscillator with selectable frequency.
pub(super) const OSCILLATOR: &[(u16, Sfr)] = sfrs! { 0x8F OSCCON 0x90 OSCTUNE };

/// Register of a watchdog with a 16-bit prescaler.
pub(super) const WATCHDOG: &[(u16, Sfr)] = sfrs! { 0x105 WDTCON };

/// Register that selects analog inputs one by one.
pub(super) const ANSEL: &[(u16, Sfr)] = sfrs! { 0x9B ANSEL };

/// Mirrors banks 0 and 1 as banks 2 and 3, for chips that do not decode RP1 and IRP; `N` is twice the length.
pub(super) const fn mirrored<const N: usize>(banks: &[(u16, Sfr)]) -> [(u16, Sfr); N] {
    let mut all = [banks[0]; N];
    let mut i = 0;
    while i < banks.len() {
        all[i] = banks[i];
        all[banks.len() + i] = (banks[i].0 + 0x100, banks[i].1);
        i += 1;
    }
    all
}

/// Rows of flags whose enable is the same bit in another register.
macro_rules! flags {
    ($($flag:ident $at:ident $enable:ident $bit:literal)*) => { &[ $( FlagLocation {
        flag: InterruptFlag::$flag, at: SfrBitPlace { sfr: Sfr::$at, bit: $bit }, enable: SfrBitPlace { sfr: Sfr::$enable, bit: $bit }, peripheral: true,
    } ),* ] };
}

/// Returns a flag that PEIE does not gate.
const fn intcon_flag(flag: InterruptFlag, at: SfrBitPlace, enable: u8) -> FlagLocation {
    FlagLocation { flag, at, enable: SfrBitPlace { sfr: Sfr::INTCON, bit: enable }, peripheral: false }
}

/// Flags in INTCON.
pub(super) const F_CORE: &[FlagLocation] = &[
    intcon_flag(InterruptFlag::T0IF, SfrBitPlace { sfr: Sfr::INTCON, bit: 2 }, 5),
    intcon_flag(InterruptFlag::INTF, SfrBitPlace { sfr: Sfr::INTCON, bit: 1 }, 4),
    intcon_flag(InterruptFlag::RBIF, SfrBitPlace { sfr: Sfr::INTCON, bit: 0 }, 3),
];
/// Flag of the 16F84's EEPROM: EEIF is in EECON1, EEIE in INTCON.
pub(super) const F_EEPROM_84: &[FlagLocation] =
    &[intcon_flag(InterruptFlag::EEIF, SfrBitPlace { sfr: Sfr::EECON1, bit: 4 }, 6)];
/// Flag of the 16C71's converter: ADIF is in ADCON0, ADIE in INTCON.
pub(super) const F_ADC_71: &[FlagLocation] =
    &[intcon_flag(InterruptFlag::ADIF, SfrBitPlace { sfr: Sfr::ADCON0, bit: 1 }, 6)];
/// Flags of timers 1 and 2 and CCP1.
pub(super) const F_TIMERS: &[FlagLocation] = flags! { TMR1IF PIR1 PIE1 0 TMR2IF PIR1 PIE1 1 CCP1IF PIR1 PIE1 2 };
/// Flag of the SSP.
pub(super) const F_SSP: &[FlagLocation] = flags! { SSPIF PIR1 PIE1 3 };
/// Flags of the USART.
pub(super) const F_USART: &[FlagLocation] = flags! { TXIF PIR1 PIE1 4 RCIF PIR1 PIE1 5 };
/// Flag of the converter.
pub(super) const F_ADC: &[FlagLocation] = flags! { ADIF PIR1 PIE1 6 };
/// Flag of the parallel slave port.
pub(super) const F_PSP: &[FlagLocation] = flags! { PSPIF PIR1 PIE1 7 };
/// Flags of the 16F62x.
pub(super) const F_62X: &[FlagLocation] = flags! { CMIF PIR1 PIE1 6 EEIF PIR1 PIE1 7 };
/// Flag of CCP2.
pub(super) const F_CCP2: &[FlagLocation] = flags! { CCP2IF PIR2 PIE2 0 };
/// Flag of the MSSP.
pub(super) const F_MSSP: &[FlagLocation] = flags! { BCLIF PIR2 PIE2 3 };
/// Flag of the EEPROM.
pub(super) const F_EEPROM: &[FlagLocation] = flags! { EEIF PIR2 PIE2 4 };
/// Flag of the comparators.
pub(super) const F_COMPARATORS: &[FlagLocation] = flags! { CMIF PIR2 PIE2 6 };
/// Flag of the clock monitor (oscillator fail).
pub(super) const F_OSCILLATOR: &[FlagLocation] = flags! { OSFIF PIR2 PIE2 7 };
