//! Cases from DS40002061, one per line; the section comes first.

use crate::script::check;

const HZ: u64 = 16_000_000;

#[test]
fn ports() {
    check(
        HZ,
        "
        # OUT, IN at once and after one NOP.
        14.2.4 the synchroniser is one cycle late          | 5:DDRB=20 6:PORTB=20 7:PINB?00 8:PINB?20
        14.2.4 an outside level too                        | 9:PC2=H 9:PINC?00 10:PINC?04 20:PC2=L 20:PINC?04 21:PINC?00
        14.2.4 a pulse of one cycle is seen for one cycle  | 9:PC2=H 9:PINC?00 10:PC2=L 10:PINC?04 11:PINC?00
        14.2.1 output low and high                         | 1:DDRD=80 3:PD7?L 4:PORTD=80 5:PD7?H 6:DDRD=00 7:PD7?H
        14.2.1 an input without pull-up floats             | 1:PB0?Z 2:DDRB=01 3:PB0?L 4:DDRB=00 5:PB0?Z
        14.2.1 pull-up                                     | 1:PORTB=01 2:PB0?H 3:PINB?01 4:PB0=L 5:PB0?L 6:PINB?00 7:PB0=Z 8:PB0?H
        14.2.1 PUD switches all pull-ups off               | 1:PORTB=03 3:MCUCR=10 5:PB1?Z 6:MCUCR?10 7:MCUCR=00 8:PB1?H
        14.2.2 writing 1 to PINx toggles PORTx             | 1:DDRB=0F 2:PORTB=05 3:PINB=0C 4:PORTB?09 4:PB2?L 4:PB3?H
        14.2.2 SBI on PINx toggles one bit                 | 1:DDRB=FF 2:PORTB=F0 6:PINB|10 7:PORTB?E0 8:PINB&20 9:PORTB?E0
        14.2.2 SBI and CBI leave the other bits            | 1:PORTC=05 3:PORTC|02 4:PORTC?07 5:PORTC&04 6:PORTC?03
        14.4   PC7 does not exist                          | 1:DDRC=FF 2:PORTC=FF 3:DDRC?7F 3:PORTC?7F 9:PINC?7F
        14.2.4 a steady pin may be polled over             | 9:PB0=H 9:steady.PINB?9 10:steady.PINB?-
        24.9.5 DIDR0 makes PINC read 0                     | 1:PORTC=3F 3:PINC?3F 4:DIDR0=21 5:PINC?1E
        23.3.3 DIDR1 is PD6 and PD7                        | 1:PORTD=FF 3:PIND?FF 4:DIDR1=02 5:PIND?7F
        ",
    );
}

#[test]
fn timers() {
    check(
        HZ,
        "
        15.4   TCNT written in cycle t reads v at t+1      | 1:TCCR0B=01 9:TCNT0=10 10:TCNT0?10 11:TCNT0?11 20:TCNT0?1A
        15.3   clk/1 starts with the edge after the write  | 5:TCCR0B=01 6:TCNT0?00 7:TCNT0?01
        15.3   the prescaler runs from reset               | 5:TCCR0B=02 7:TCNT0?00 8:TCNT0?01 16:TCNT0?02
        15.3   stopping keeps the count                    | 5:TCCR0B=01 9:TCCR0B=00 10:TCNT0?04 99:TCNT0?04 99:steady.TCNT0?-
        15.7.1 normal mode: TOV at 255 -> 0                | 1:TCCR0B=01 9:TCNT0=FE 11:TIFR0?06 11:TCNT0?FF 12:TCNT0?00 12:TIFR0?07
        15.7.2 CTC: OCR+1 clocks, no TOV                   | 1:OCR0A=03 2:OCR0B=FF 3:TCCR0A=02 4:TCCR0B=01 8:TCNT0?03 8:TIFR0?00 9:TCNT0?00 9:TIFR0?02 12:TCNT0?03 13:TCNT0?00
        15.7.2 CTC: a count above OCR runs on to 255       | 1:OCR0A=03 2:TCCR0A=02 3:TCCR0B=01 9:TCNT0=FD 12:TCNT0?FF 12:TIFR0?06 13:TCNT0?00 13:TIFR0?07 17:TCNT0?00
        15.7.2 CTC: OCR of 255 sets TOV too                | 1:OCR0A=FF 2:TCCR0A=02 3:TCCR0B=01 9:TCNT0=FE 11:TIFR0?04 12:TIFR0?07
        15.7.2 CTC: OCR of 0 stays at 0                    | 1:TCCR0A=02 2:TCCR0B=01 3:TIFR0?00 4:TIFR0?06 9:TCNT0?00 9:TIFR0=06 10:TIFR0?06
        15.7.2 a new OCR acts at once                      | 1:OCR0A=50 2:TCCR0A=02 3:TCCR0B=01 9:OCR0A=06 10:TCNT0?06 11:TCNT0?00
        15.8   the flag comes with the edge after the match| 1:TCCR0B=02 2:OCR0A=02 3:TIFR0=07 16:TCNT0?02 23:TIFR0?04 24:TIFR0?06
        15.5.2 a write of TCNT hides the next match        | 1:TCCR0B=01 2:OCR0A=20 3:TIFR0=07 9:TCNT0=20 10:TCNT0?20 11:TIFR0?00
        15.5.2 also while the timer is stopped             | 1:OCR0A=20 9:TCNT0=20 19:TCCR0B=01 30:TCNT0?2A 30:TIFR0?00
        15.5.2 in CTC the count then runs past OCR         | 1:OCR0A=20 2:TCCR0A=02 3:TCCR0B=01 9:TCNT0=20 12:TCNT0?22
        15.5.2 one below OCR the match is seen             | 1:TCCR0B=01 2:OCR0A=20 3:TIFR0=07 9:TCNT0=1F 11:TIFR0?00 12:TIFR0?02
        15.9.7 flags are cleared by 1, one at a time       | 1:TCCR0B=01 300:TIFR0?07 300:TIFR0|02 301:TIFR0?05 302:TIFR0=01 303:TIFR0?04 304:TIFR0&04 305:TIFR0?04
        15.9.6 interrupts by priority; taking clears       | 1:TCCR0B=01 2:TIMSK0=07 3:irq?TIMER0_COMPA 300:take=TIMER0_COMPA 300:irq?TIMER0_COMPB 300:take=TIMER0_COMPB 300:irq?TIMER0_OVF 300:take=TIMER0_OVF 300:irq?- 300:deadline?514
        15.9.6 the deadline is the enabled flag's cycle    | 1:OCR0A=63 2:TCCR0B=01 9:deadline?- 9:TIMSK0=02 10:deadline?103 102:irq?- 103:irq?TIMER0_COMPA
        15.9.7 a flag may be polled over to its change     | 1:OCR0A=63 2:TCCR0B=01 9:TIFR0=07 10:steady.TIFR0?103 10:steady.TCNT0?11
        16.3   TEMP: high byte first when writing          | 1:TCNT1H=12 2:TCNT1L=34 3:TCNT1L!34 4:TCNT1H!12
        16.3   TEMP: reading low latches high              | 1:TCNT1H=12 2:TCNT1L=FF 3:TCNT1L!FF 4:TCCR1B=01 9:TCNT1H!12 9:TCNT1L!03 10:TCNT1H!13
        16.3   OCR1 reads go past TEMP                     | 1:OCR1AH=12 2:OCR1AL=34 3:TCNT1H=77 4:OCR1AH!12 5:OCR1AL!34 6:TCNT1H!77
        16.3   TEMP is shared                              | 1:OCR1AH=12 2:OCR1BL=34 3:OCR1BH?12 3:OCR1AH?00
        16.9.2 CTC with OCR1A                              | 1:OCR1AH=01 2:OCR1AL=2C 3:TCCR1B=09 304:TCNT1L?2C 304:TIFR1?04 305:TCNT1L?00 305:TIFR1?06
        16.9.2 CTC with ICR1 sets ICF1                     | 1:TCCR1B=18 2:ICR1H=00 3:ICR1L=09 4:OCR1AL=FF 5:TCCR1B=19 15:TCNT1L?09 15:TIFR1?04 16:TCNT1L?00 16:TIFR1?24
        16.6   ICR1 is written in any mode, on silicon     | 1:ICR1H=12 2:ICR1L=34 3:ICR1L!34 4:ICR1H!12 4:TCCR1B=18 5:ICR1H=56 6:ICR1L=78 7:ICR1L!78 8:ICR1H!56
        16.9.1 normal mode: TOV1                           | 1:TCCR1B=01 8:TCNT1H=FF 9:TCNT1L=FE 12:TIFR1?07 13:TCNT1L?01
        17.1   timers 0 and 1 share the prescaler          | 1:TCCR0B=02 1:TCCR1B=02 99:GTCCR=01 107:TCNT0?0C 107:TCNT1L?0C 108:TCNT0?0D 108:TCNT1L?0D
        17.4.1 PSRSYNC restarts it                         | 1:TCCR0B=02 10:GTCCR=01 11:GTCCR?00 18:TCNT0?01 19:TCNT0?02 27:TCNT0?03
        17.4.1 PSRASY is timer 2's                         | 1:TCCR0B=02 1:TCCR2B=02 10:GTCCR=02 16:TCNT0?02 16:TCNT2?01 19:TCNT2?02
        17.4.1 TSM holds it                                | 1:TCCR0B=02 10:GTCCR=81 11:GTCCR?81 99:TCNT0?01 100:GTCCR=00 101:GTCCR?00 108:TCNT0?01 109:TCNT0?02
        18.10  timer 2 divides by 32 and 128               | 1:TCCR2B=03 32:TCNT2?01 64:TCNT2?02 65:TCNT2=00 65:TCCR2B=05 127:TCNT2?00 128:TCNT2?01
        18.7.2 timer 2 in CTC                              | 1:OCR2A=02 2:TCCR2A=02 3:TCCR2B=01 6:TCNT2?02 7:TCNT2?00 7:TIFR2?06 7:TIMSK2=02 8:irq?TIMER2_COMPA
        12.4   lower vectors first                         | 1:TCCR0B=01 1:TCCR1B=01 1:TCCR2B=01 2:TIMSK0=02 3:TIMSK1=02 9:irq?TIMER1_COMPA 9:TIMSK2=04 10:irq?TIMER2_COMPB
        10     a running enabled timer can wake            | 1:wakes?n 2:TIMSK0=01 3:wakes?n 4:TCCR0B=05 5:wakes?y
        36     reads of FOC bits are 0, others are kept    | 1:TCCR0A=FF 2:TCCR0B=C8 3:TCCR0A?F3 3:TCCR0B?08 4:TCCR1B=FF 5:TCCR1B?DF 6:TIMSK1=FF 7:TIMSK1?27
        ",
    );
}

#[test]
fn usart() {
    check(
        HZ,
        "
        20.11  reset values                                | 1:UCSR0A?20 1:UCSR0B?00 1:UCSR0C?06 1:UBRR0L?00
        20.6.5 TXEN takes the pin and rests high           | 1:DDRD=02 2:PD1?L 3:UCSR0B=08 4:PD1?H 5:PORTD=00 6:PD1?H 7:UCSR0B=00 8:PD1?L
        20.6.1 first byte: UDRE is set again at once       | 1:UCSR0B=08 5:UDR0=55 6:UCSR0A?20 7:UDR0=AA 8:UCSR0A?00 9:busy?y
        # Loaded at 5, so the edges of the bit clock are 5 + 32 k: start at 37, bits at 69.., stop at 325, end at 357.
        20.6.1 start, eight bits from the lowest, stop     | 1:UCSR0B=08 4:UBRR0L=01 9:UDR0=35 36:PD1?H 37:PD1?L 68:PD1?L 69:PD1?H 101:PD1?L 133:PD1?H 165:PD1?L 197:PD1?H 229:PD1?H 261:PD1?L 293:PD1?L 324:PD1?L 325:PD1?H 356:UCSR0A?20 357:UCSR0A?60 357:busy?n
        20.6.1 double speed: eight clocks a bit            | 1:UCSR0B=08 2:UCSR0A=02 4:UBRR0L=01 9:UDR0=01 20:PD1?H 21:PD1?L 37:PD1?H 53:PD1?L 181:UCSR0A?62
        20.6.3 no gap, and TXC only after the last         | 1:UCSR0B=08 4:UBRR0L=01 9:UDR0=FF 12:UDR0=00 356:UCSR0A?00 356:PD1?H 357:UCSR0A?20 357:PD1?L 676:UCSR0A?20 677:UCSR0A?60
        20.6.3 TXC is cleared by 1 and by its interrupt    | 1:UCSR0B=48 9:UDR0=00 400:irq?USART_TX 400:take=USART_TX 400:UCSR0A?20 401:UDR0=00 900:UCSR0A?60 900:UCSR0A=40 901:UCSR0A?20
        20.6.3 UDRE interrupts while the buffer is empty   | 1:UCSR0B=28 2:irq?USART_UDRE 3:take=USART_UDRE 3:irq?USART_UDRE 4:UDR0=00 5:irq?USART_UDRE 6:UDR0=00 7:irq?- 176:irq?USART_UDRE
        20.6.5 switching off waits for the last byte       | 1:UCSR0B=08 4:UBRR0L=01 9:UDR0=00 50:UCSR0B=00 300:PD1?L 340:PD1?H 357:PD1?Z
        20.11.1 a full buffer ignores a write              | 1:UCSR0B=08 4:UBRR0L=01 9:UDR0=00 10:UDR0=FF 11:UDR0=00 370:PD1?L 400:PD1?H
        # UBRR0 = 0, 16 cycles a bit. The line falls at 100 and is seen at 101; the votes on the stop bit are at 252, 253, 254.
        20.7.3 a byte arrives with the stop bit's majority | 1:UCSR0B=10 2:UBRR0L=00 50:PD0=H 100:PD0=L 116:PD0=H 132:PD0=L 148:PD0=H 164:PD0=L 180:PD0=H 196:PD0=L 212:PD0=H 228:PD0=L 244:PD0=H 253:UCSR0A?20 254:UCSR0A?A0 255:UDR0!55 256:UCSR0A?20
        20.8.1 a short start bit is noise                  | 1:UCSR0B=10 50:PD0=H 100:PD0=L 107:PD0=H 400:UCSR0A?20 500:PD0=L 516:PD0=H 700:UCSR0A?A0 701:UDR0!FF
        20.8.2 two of three samples decide                 | 1:UCSR0B=10 50:PD0=H 100:PD0=L 109:PD0=H 400:UCSR0A?A0 401:UDR0!FF
        20.8.2 a start bit may follow the last vote        | 1:UCSR0B=10 50:PD0=H 100:PD0=L 116:PD0=H 254:PD0=L 270:PD0=H 271:UDR0!FF 407:UCSR0A?20 408:UCSR0A?A0 409:UDR0!FF
        20.7.4 a missing stop bit is a frame error         | 1:UCSR0B=10 50:PD0=H 100:PD0=L 400:UCSR0A?B0 401:UDR0!00 402:UCSR0A?20 900:UCSR0A?20
        20.7.3 RXC interrupts until UDR0 is read           | 1:UCSR0B=90 50:PD0=H 100:PD0=L 116:PD0=H 400:irq?USART_RX 401:take=USART_RX 401:irq?USART_RX 402:UDR0!FF 403:irq?-
        20.7.6 RXEN off empties the buffer                 | 1:UCSR0B=10 50:PD0=H 100:PD0=L 116:PD0=H 400:UCSR0B=00 401:UCSR0A?20 402:UCSR0B=10 403:UCSR0A?20
        20.7   RXEN makes RXD an input with its pull-up    | 1:DDRD=01 2:PD0?L 3:UCSR0B=10 4:PORTD=01 5:PD0?H 6:PD0=L 7:PD0?L
        20.11.3 a receiver that may interrupt can wake     | 1:UCSR0B=10 2:wakes?n 3:UCSR0B=90 4:wakes?y 5:UCSR0B=80 6:wakes?n
        20.11.5 UBRR0 has twelve bits                      | 1:UBRR0H=FF 2:UBRR0L=FF 3:UBRR0H?0F 3:UBRR0L?FF
        ",
    );
}

#[test]
fn watchdog() {
    // At 16 MHz a clock of the watchdog is 125 cycles, and 2048 of them are 256,000 cycles.
    check(
        HZ,
        "
        11.8   interrupt after 16 ms                       | 9:WDTCSR=40 10:wakes?y 10:deadline?256010 256009:irq?- 256010:irq?WDT 256010:WDTCSR?C0 256010:take=WDT 256011:WDTCSR?40 256011:deadline?512010
        11.8   WDR starts the count again                  | 9:WDTCSR=40 99:wdr 100:deadline?256100
        11.8   the prescaler needs the timed sequence      | 9:WDTCSR=18 10:WDTCSR?18 13:WDTCSR=21 14:WDTCSR?21 15:deadline?-
        11.8   four cycles later it is too late            | 9:WDTCSR=18 14:WDTCSR?08 14:WDTCSR=47 15:WDTCSR?48
        11.8   in time, 2 s                                | 9:WDTCSR=18 11:WDTCSR=0F 12:WDTCSR?0F 12:deadline?32768010
        11.8   in time, 8 s                                | 9:WDTCSR=18 11:WDTCSR=69 12:WDTCSR?69 12:deadline?131072010
        11.8   WDE cannot be cleared without it            | 9:WDTCSR=08 20:WDTCSR=00 21:WDTCSR?08
        11.9.2 system reset, WDRF, and WDE stays on        | 9:WDTCSR=08 256009:reset?n 256010:reset?y 256011:reset?n 256011:MCUSR?09 256011:WDTCSR?08 256011:deadline?512010
        11.9.1 WDRF keeps WDE set                          | 9:WDTCSR=08 256010:reset?y 256020:WDTCSR=18 256022:WDTCSR=00 256023:WDTCSR?08 256030:MCUSR=00 256031:MCUSR?00 256040:WDTCSR=18 256042:WDTCSR=00 256043:WDTCSR?00
        11.9.2 interrupt first, then reset                 | 9:WDTCSR=48 256010:irq?WDT 256010:take=WDT 256011:WDTCSR?08 512009:reset?n 512010:reset?y
        11.9.2 reset when nobody takes the interrupt       | 9:WDTCSR=48 256010:irq?WDT 512010:reset?y
        11.9.2 WDIF is cleared by 1                        | 9:WDTCSR=40 300000:WDTCSR?C0 300001:WDTCSR=C0 300002:WDTCSR?40
        11.9.1 power-on sets PORF alone; 0 clears          | 1:MCUSR?01 2:MCUSR=FE 3:MCUSR?00 4:MCUSR=FF 5:MCUSR?00
        ",
    );
    // 8 MHz: 62.5 cycles per clock. 3 MHz: 23.4375 cycles, so 48,000 for 2048.
    check(8_000_000, "11.8 half the clock | 9:WDTCSR=40 10:deadline?128010");
    check(
        1_000_001,
        "11.8 rounded up to a whole cycle | 9:WDTCSR=40 10:deadline?16011 16011:take=WDT 16012:deadline?32011",
    );
}

#[test]
fn plain_registers() {
    check(
        HZ,
        "
        36     general purpose registers                   | 1:GPIOR0=A5 2:GPIOR0|0A 3:GPIOR0?AF 4:GPIOR1=12 5:GPIOR1?12 6:GPIOR2=FF 7:GPIOR2?FF 8:GPIOR0&80 9:GPIOR0?2F
        36     reserved bits read 0                        | 1:SMCR=FF 2:SMCR?0F 3:PCMSK1=FF 4:PCMSK1?7F 5:PRR=FF 6:PRR?EF
        22.9   reset values                                | 1:TWSR?F8 1:TWAR?FE 1:TWDR?FF
        ",
    );
}
