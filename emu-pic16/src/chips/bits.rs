//! Bits of registers, in groups from which each chip row takes its own (data sheets, the sections of the
//! peripherals).

use super::SfrBit;
use crate::periph::map::Sfr;

/// Names of register pairs in the headers, each with the register whose address it has. A chip that has the
/// register has the name.
pub const ALIASES: &[(&str, Sfr)] = &[("TMR1", Sfr::TMR1L), ("CCPR1", Sfr::CCPR1L), ("CCPR2", Sfr::CCPR2L)];

/// Rows of bits: register, then pairs of name and bit number.
macro_rules! bits {
    ($($reg:ident: $($name:ident $bit:literal)*;)*) => { &[ $( $( SfrBit { sfr: Sfr::$reg, name: stringify!($name), bit: $bit } ),* ),* ] };
}

/// Bits of STATUS, OPTION_REG, and ports A and B that every chip has.
#[rustfmt::skip]
pub(super) const CORE: &[SfrBit] = bits! {
    STATUS: C 0 DC 1 Z 2 NOT_PD 3 NOT_TO 4 RP0 5 RP1 6 IRP 7;
    OPTION: PS0 0 PS1 1 PS2 2 PSA 3 T0SE 4 T0CS 5 INTEDG 6 NOT_RBPU 7;
    PORTA:  RA0 0 RA1 1 RA2 2 RA3 3 RA4 4;
    TRISA:  TRISA0 0 TRISA1 1 TRISA2 2 TRISA3 3 TRISA4 4;
    PORTB:  RB0 0 RB1 1 RB2 2 RB3 3 RB4 4 RB5 5 RB6 6 RB7 7;
    TRISB:  TRISB0 0 TRISB1 1 TRISB2 2 TRISB3 3 TRISB4 4 TRISB5 5 TRISB6 6 TRISB7 7;
    INTCON: RBIF 0 RBIE 3 GIE 7;
};
/// Bit RA5 of port A.
pub(super) const RA5: &[SfrBit] = bits! { PORTA: RA5 5; TRISA: TRISA5 5; };
/// Bits RA5 to RA7 of port A.
pub(super) const RA5_7: &[SfrBit] = bits! { PORTA: RA5 5 RA6 6 RA7 7; TRISA: TRISA5 5 TRISA6 6 TRISA7 7; };
/// Bits of the external interrupt.
pub(super) const INT: &[SfrBit] = bits! { INTCON: INTF 1 INTE 4; };
/// Bits of the external interrupt by the names of the 16F87 and 88.
pub(super) const INT0: &[SfrBit] = bits! { INTCON: INT0IF 1 INT0IE 4; };
/// Bits of timer 0 by their older names.
pub(super) const T0: &[SfrBit] = bits! { INTCON: T0IF 2 T0IE 5; };
/// Bits of timer 0 by their newer names.
pub(super) const TMR0: &[SfrBit] = bits! { INTCON: TMR0IF 2 TMR0IE 5; };

/// Bits of port C.
#[rustfmt::skip]
pub(super) const PORT_C: &[SfrBit] = bits! {
    PORTC: RC0 0 RC1 1 RC2 2 RC3 3 RC4 4 RC5 5 RC6 6 RC7 7;
    TRISC: TRISC0 0 TRISC1 1 TRISC2 2 TRISC3 3 TRISC4 4 TRISC5 5 TRISC6 6 TRISC7 7;
};
/// Bits of ports D and E with the parallel slave port.
#[rustfmt::skip]
pub(super) const PORT_DE: &[SfrBit] = bits! {
    PORTD: RD0 0 RD1 1 RD2 2 RD3 3 RD4 4 RD5 5 RD6 6 RD7 7;
    TRISD: TRISD0 0 TRISD1 1 TRISD2 2 TRISD3 3 TRISD4 4 TRISD5 5 TRISD6 6 TRISD7 7;
    PORTE: RE0 0 RE1 1 RE2 2;
    TRISE: TRISE0 0 TRISE1 1 TRISE2 2 PSPMODE 4 IBOV 5 OBF 6 IBF 7;
    PIR1:  PSPIF 7;
    PIE1:  PSPIE 7;
};

/// Bits of timers 1 and 2 and CCP1, PEIE, and PCON.
#[rustfmt::skip]
pub(super) const TIMERS: &[SfrBit] = bits! {
    INTCON:  PEIE 6;
    PIR1:    TMR1IF 0 TMR2IF 1 CCP1IF 2;
    PIE1:    TMR1IE 0 TMR2IE 1 CCP1IE 2;
    PCON:    NOT_BOR 0 NOT_POR 1 NOT_BO 0;
    T1CON:   TMR1ON 0 TMR1CS 1 NOT_T1SYNC 2 T1OSCEN 3 T1CKPS0 4 T1CKPS1 5;
    T2CON:   T2CKPS0 0 T2CKPS1 1 TMR2ON 2 TOUTPS0 3 TOUTPS1 4 TOUTPS2 5 TOUTPS3 6;
    CCP1CON: CCP1M0 0 CCP1M1 1 CCP1M2 2 CCP1M3 3 CCP1Y 4 CCP1X 5;
};
/// Second name of the bit that controls the synchronization of timer 1.
pub(super) const T1INSYNC: &[SfrBit] = bits! { T1CON: T1INSYNC 2; };
/// Third name of the bit that controls the synchronization of timer 1.
pub(super) const T1SYNC: &[SfrBit] = bits! { T1CON: T1SYNC 2; };
/// T1RUN: the clock of timer 1 runs the chip.
pub(super) const T1RUN: &[SfrBit] = bits! { T1CON: T1RUN 6; };
/// Bits of CCP2.
#[rustfmt::skip]
pub(super) const CCP2: &[SfrBit] = bits! {
    CCP2CON: CCP2M0 0 CCP2M1 1 CCP2M2 2 CCP2M3 3 CCP2Y 4 CCP2X 5;
    PIR2:    CCP2IF 0;
    PIE2:    CCP2IE 0;
};

/// Bits of the synchronous serial port.
#[rustfmt::skip]
pub(super) const SSP: &[SfrBit] = bits! {
    SSPCON:  SSPM0 0 SSPM1 1 SSPM2 2 SSPM3 3 CKP 4 SSPEN 5 SSPOV 6 WCOL 7;
    SSPSTAT: BF 0 UA 1 R_NOT_W 2 S 3 P 4 D_NOT_A 5 CKE 6 SMP 7
             R 2 D 5 I2C_READ 2 I2C_START 3 I2C_STOP 4 I2C_DATA 5 NOT_W 2 NOT_A 5 NOT_WRITE 2 NOT_ADDRESS 5 R_W 2 D_A 5
             READ_WRITE 2 DATA_ADDRESS 5;
    PIR1:    SSPIF 3;
    PIE1:    SSPIE 3;
};
/// Additional bits of the MSSP, which can be an I2C master.
#[rustfmt::skip]
pub(super) const MSSP: &[SfrBit] = bits! {
    SSPCON2: SEN 0 RSEN 1 PEN 2 RCEN 3 ACKEN 4 ACKDT 5 ACKSTAT 6 GCEN 7;
    PIR2:    BCLIF 3;
    PIE2:    BCLIE 3;
};

/// Bits of the USART, except the enable of address detection.
#[rustfmt::skip]
pub(super) const USART: &[SfrBit] = bits! {
    RCSTA: RX9D 0 OERR 1 FERR 2 CREN 4 SREN 5 RX9 6 SPEN 7;
    TXSTA: TX9D 0 TRMT 1 BRGH 2 SYNC 4 TXEN 5 TX9 6 CSRC 7;
    PIR1:  TXIF 4 RCIF 5;
    PIE1:  TXIE 4 RCIE 5;
};
/// Enable of address detection on the 16F87x, and other names.
#[rustfmt::skip]
pub(super) const USART_87X: &[SfrBit] = bits! {
    RCSTA: ADDEN 3 RCD8 0 RC9 6 NOT_RC8 6 RC8_9 6;
    TXSTA: TXD8 0 NOT_TX8 6 TX8_9 6;
};
/// Enable of address detection on the 16F62x.
pub(super) const USART_62X: &[SfrBit] = bits! { RCSTA: ADEN 3 ADDEN 3; };

/// Bits of the converter that all variants have.
#[rustfmt::skip]
pub(super) const ADC_ANY: &[SfrBit] = bits! {
    ADCON0: ADON 0 GO_NOT_DONE 2 GO 2 CHS0 3 CHS1 4 ADCS0 6 ADCS1 7 NOT_DONE 2 GO_DONE 2;
};
/// Bits of the converter of the 16C71.
pub(super) const ADC_71: &[SfrBit] = bits! { ADCON0: ADIF 1; ADCON1: PCFG0 0 PCFG1 1; INTCON: ADIE 6; };
/// Bits of a 10-bit converter.
pub(super) const ADC: &[SfrBit] = bits! { ADCON0: CHS2 5; ADCON1: ADFM 7; PIR1: ADIF 6; PIE1: ADIE 6; };
/// Bits that select all analog inputs together.
pub(super) const PCFG: &[SfrBit] = bits! { ADCON1: PCFG0 0 PCFG1 1 PCFG2 2 PCFG3 3; };
/// Third bit of the converter's clock selection.
pub(super) const ADCS2: &[SfrBit] = bits! { ADCON1: ADCS2 6; };
/// Bits that select analog inputs one by one.
#[rustfmt::skip]
pub(super) const ANSEL: &[SfrBit] = bits! {
    ADCON1: VCFG0 4 VCFG1 5;
    ANSEL:  ANS0 0 ANS1 1 ANS2 2 ANS3 3 ANS4 4 ANS5 5 ANS6 6;
};

/// Bits of the comparators.
pub(super) const CMCON: &[SfrBit] = bits! { CMCON: CM0 0 CM1 1 CM2 2 CIS 3 C1INV 4 C2INV 5 C1OUT 6 C2OUT 7; };
/// Bits of the comparators' reference and interrupt.
#[rustfmt::skip]
pub(super) const CVRCON: &[SfrBit] = bits! {
    CVRCON: CVR0 0 CVR1 1 CVR2 2 CVR3 3 CVRR 5 CVROE 6 CVREN 7;
    PIR2:   CMIF 6;
    PIE2:   CMIE 6;
};
/// Bits and names that only the 16F62x have.
#[rustfmt::skip]
pub(super) const F62X: &[SfrBit] = bits! {
    CVRCON: VR0 0 VR1 1 VR2 2 VR3 3 VRR 5 VROE 6 VREN 7;
    PIR1:   CMIF 6 EEIF 7;
    PIE1:   CMIE 6 EEIE 7;
    PCON:   OSCF 3 NOT_BOD 0;
};

/// Bits of the EEPROM.
pub(super) const EEPROM: &[SfrBit] = bits! { EECON1: RD 0 WR 1 WREN 2 WRERR 3; };
/// Additional bits of the EEPROM of the 16F84.
pub(super) const EEPROM_84: &[SfrBit] = bits! { EECON1: EEIF 4; INTCON: EEIE 6; };
/// Bits of access to program memory.
pub(super) const FLASH: &[SfrBit] = bits! { EECON1: EEPGD 7; PIR2: EEIF 4; PIE2: EEIE 4; };
/// Bit that selects erasing of program memory.
pub(super) const FREE: &[SfrBit] = bits! { EECON1: FREE 4; };

/// Bits of the internal oscillator.
#[rustfmt::skip]
pub(super) const OSCILLATOR: &[SfrBit] = bits! {
    OSCCON:  IOFS 2 IRCF0 4 IRCF1 5 IRCF2 6;
    OSCTUNE: TUN0 0 TUN1 1 TUN2 2 TUN3 3 TUN4 4 TUN5 5;
};
/// Additional bits of the 16F87 and 88: clock selection and monitor, longer watchdog.
#[rustfmt::skip]
pub(super) const CLOCKS: &[SfrBit] = bits! {
    OSCCON: SCS0 0 SCS1 1 OSTS 3;
    PIR2:   OSFIF 7;
    PIE2:   OSFIE 7;
    WDTCON: SWDTEN 0 SWDTE 0 WDTPS0 1 WDTPS1 2 WDTPS2 3 WDTPS3 4;
};
