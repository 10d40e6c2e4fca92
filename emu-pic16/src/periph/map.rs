//! Names that all peripherals share: registers, interrupt flags, lines.

macro_rules! registers {
    ($($name:ident)*) => {
        /// A special function register, by its name in the data sheets. A register with different names on
        /// two chips has that of the PIC16F87XA here (VRCON of the 628 is CVRCON, ADRES of the 71 is ADRESH).
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        #[allow(missing_docs)]
        pub enum Sfr { $($name),* }

        impl Sfr {
            /// All registers, in order.
            pub const ALL: &[Sfr] = &[ $(Sfr::$name),* ];

            /// Returns the name of the register.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Sfr::$name => stringify!($name)),* }
            }
        }
    };
}

#[rustfmt::skip]
registers! {
    INDF TMR0 PCL STATUS FSR PCLATH INTCON OPTION
    PORTA PORTB PORTC PORTD PORTE TRISA TRISB TRISC TRISD TRISE
    PIR1 PIR2 PIE1 PIE2 PCON OSCCON OSCTUNE WDTCON
    TMR1L TMR1H T1CON TMR2 T2CON PR2
    CCPR1L CCPR1H CCP1CON CCPR2L CCPR2H CCP2CON
    SSPBUF SSPCON SSPCON2 SSPADD SSPSTAT
    RCSTA TXSTA TXREG RCREG SPBRG
    ADRESH ADRESL ADCON0 ADCON1 ANSEL CMCON CVRCON
    EEDATA EEADR EEDATH EEADRH EECON1 EECON2
}

/// An interrupt flag. The chip's row gives its register (PIR1, PIR2, INTCON, EECON1, ADCON0).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
#[rustfmt::skip]
pub enum InterruptFlag {
    T0IF, INTF, RBIF, TMR1IF, TMR2IF, CCP1IF, CCP2IF, SSPIF, BCLIF, RCIF, TXIF, ADIF, EEIF, CMIF, PSPIF, OSFIF,
}

/// A line between a peripheral and a pin. The chip's row gives the pin; a line that the chip does not have
/// stays low.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Pic16Line {
    /// Clock input of timer 0.
    T0cki,
    /// External interrupt.
    Int,
    /// Clock input of timer 1.
    T1cki,
    /// Capture, compare and PWM 1.
    Ccp1,
    /// Capture, compare and PWM 2.
    Ccp2,
    /// USART: transmit, or the clock of synchronous mode.
    Tx,
    /// USART: receive, or the data of synchronous mode.
    Rx,
    /// SPI and I2C clock: SCK, SCL.
    Sck,
    /// SPI data in, I2C data: SDI, SDA.
    Sdi,
    /// SPI data out.
    Sdo,
    /// SPI slave select.
    Ss,
    /// Output of comparator 1.
    C1out,
    /// Output of comparator 2.
    C2out,
    /// Parallel slave port: read strobe.
    Rd,
    /// Parallel slave port: write strobe.
    Wr,
    /// Parallel slave port: chip select.
    Cs,
}
