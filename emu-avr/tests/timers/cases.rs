//! Cases from DS40002061, one per line, without PWM pins and the asynchronous timer; the section comes first.

use emu_avr::periph::timers::TimerShape;

use crate::script::check;

#[test]
fn an_8_bit_timer_counts() {
    check(
        TimerShape::narrow(2),
        "
        15.4   TCNT written in cycle t reads v at t+1      | 1:TCCRB=01 9:TCNT=10 10:TCNT?10 11:TCNT?11 20:TCNT?1A
        15.3   clk/1 starts with the edge after the write  | 5:TCCRB=01 6:TCNT?00 7:TCNT?01
        15.3   the prescaler runs from reset               | 5:TCCRB=02 7:TCNT?00 8:TCNT?01 16:TCNT?02
        15.3   stopping keeps the count                    | 5:TCCRB=01 9:TCCRB=00 10:TCNT?04 99:TCNT?04 99:steady.TCNT?-
        15.7.1 normal mode: TOV at 255 -> 0                | 1:TCCRB=01 9:TCNT=FE 11:TIFR?06 11:TCNT?FF 12:TCNT?00 12:TIFR?07
        15.7.2 CTC: OCR+1 clocks, no TOV                   | 1:OCRA=03 2:OCRB=FF 3:TCCRA=02 4:TCCRB=01 8:TCNT?03 8:TIFR?00 9:TCNT?00 9:TIFR?02 12:TCNT?03 13:TCNT?00
        15.7.2 CTC: a count above OCR runs on to 255       | 1:OCRA=03 2:TCCRA=02 3:TCCRB=01 9:TCNT=FD 12:TCNT?FF 12:TIFR?06 13:TCNT?00 13:TIFR?07 17:TCNT?00
        15.7.2 CTC: OCR of 255 sets TOV too                | 1:OCRA=FF 2:TCCRA=02 3:TCCRB=01 9:TCNT=FE 11:TIFR?04 12:TIFR?07
        15.7.2 CTC: OCR of 0 stays at 0                    | 1:TCCRA=02 2:TCCRB=01 3:TIFR?00 4:TIFR?06 9:TCNT?00 9:TIFR=06 10:TIFR?06
        15.7.2 a new OCR acts at once                      | 1:OCRA=50 2:TCCRA=02 3:TCCRB=01 9:OCRA=06 10:TCNT?06 11:TCNT?00
        15.8   the flag comes with the edge after the match| 1:TCCRB=02 2:OCRA=02 3:TIFR=07 16:TCNT?02 23:TIFR?04 24:TIFR?06
        15.5.2 a write of TCNT hides the next match        | 1:TCCRB=01 2:OCRA=20 3:TIFR=07 9:TCNT=20 10:TCNT?20 11:TIFR?00
        15.5.2 also while the timer is stopped             | 1:OCRA=20 9:TCNT=20 19:TCCRB=01 30:TCNT?2A 30:TIFR?00
        15.5.2 in CTC the count then runs past OCR         | 1:OCRA=20 2:TCCRA=02 3:TCCRB=01 9:TCNT=20 12:TCNT?22
        15.5.2 one below OCR the match is seen             | 1:TCCRB=01 2:OCRA=20 3:TIFR=07 9:TCNT=1F 11:TIFR?00 12:TIFR?02
        15.5.2 a fixed TOP is no match: it cannot be hidden| 1:TCCRA=03 2:TCCRB=01 9:TCNT=FF 10:TCNT?FF 11:TCNT?00 11:TIFR&01=01
        15.9.7 flags are cleared by 1                      | 1:TCCRB=01 300:TIFR?07 300:TIFR=02 301:TIFR?05 302:TIFR=01 303:TIFR?04
        15.9.6 taking clears, one at a time                | 1:TCCRB=01 2:TIMSK=07 3:irq?03 300:irq?07 300:take=0 300:irq?06 300:take=1 300:take=2 300:irq?00 300:next?514
        15.9.6 the deadline is the enabled flag's cycle    | 1:OCRA=63 2:TCCRB=01 9:next?- 9:TIMSK=02 10:next?103 102:irq?00 103:irq?01
        15.9.7 a flag may be polled over to its change     | 1:OCRA=63 2:TCCRB=01 9:TIFR=07 10:steady.TIFR?103 10:steady.TCNT?11
        15.9.7 flags that others listen to, enabled or not | 1:OCRA=63 2:TCCRB=01 9:listen=04 10:next?259 259:flag?2 260:next?- 300:TIFR=01 301:next?515 515:flag?2
        15.9.1 reserved modes 4 and 6 count as normal mode | 1:OCRA=05 2:TCCRA=02 3:TCCRB=09 20:TCNT?10 21:TCCRA=00 30:TCNT?1A
        17.4.1 PSRSYNC restarts the prescaler              | 1:TCCRB=02 10:gtccr=01 18:TCNT?01 19:TCNT?02 27:TCNT?03
        17.4.1 TSM holds it                                | 1:TCCRB=02 10:gtccr=81 99:TCNT?01 100:gtccr=00 108:TCNT?01 109:TCNT?02
        17.4.1 clk/1 goes past it                          | 1:TCCRB=01 10:gtccr=81 20:TCNT?12
        10.7   the clock is stopped in sleep               | 1:TCCRB=01 10:sleep 99:TCNT?08 100:wake 100:TCNT?08 101:TCNT?09
        15.9   bits that are kept                          | 1:TCCRA=FF 2:TCCRB=FF 3:TCCRA?F3 3:TCCRB?0F 4:TIMSK=FF 5:TIMSK?07 6:TCCRC=FF 7:TCCRC?00 8:ICRL=FF 9:ICRL?00 9:ASSR?00
        11.2   reset                                       | 1:TCCRB=01 2:TCCRA=40 3:OCRA=09 4:TIMSK=07 20:OCA?1 21:reset 21:OCA?- 21:TCNT?00 21:TIFR?00 21:TIMSK?00 21:OCRA?00 21:TCCRB?00 99:TCNT?00
        ",
    );
    check(
        TimerShape::narrow(0),
        "15.7.1 ATmega8, timer 0: normal mode only | 1:TCCRA=FF 2:TCCRB=FF 3:TCCRA?00 3:TCCRB?07 4:OCRA=05 5:OCRA?00 6:TCCRB=01 7:TCNT=FE 8:TIFR?00 10:TIFR?01 11:TCNT?01",
    );
    check(
        TimerShape::narrow(1),
        "15.9.6 one channel: no OCFB | 1:TCCRB=01 2:TIMSK=FF 3:TIMSK?03 9:TIFR?02 9:OCRB=33 10:OCRB?00",
    );
}

#[test]
fn an_external_clock() {
    check(
        TimerShape::narrow(2),
        "
        17.1   rising edges, three cycles later            | 1:TCCRB=07 20:T=1 22:TCNT?00 23:TCNT?01 30:T=0 40:TCNT?01
        17.1   falling edges                               | 1:TCCRB=06 20:T=1 30:T=0 32:TCNT?00 33:TCNT?01
        17.1   a pulse of one cycle counts                 | 1:TCCRB=07 20:T=1 21:T=0 22:T=1 23:T=0 24:TCNT?01 25:TCNT?02 40:TCNT?02
        17.1   within one cycle nothing is seen            | 1:TCCRB=07 20:T=1 20:T=0 40:TCNT?00
        17.1   a flag at an edge of T                      | 1:TCCRB=07 2:OCRA=01 3:TIMSK=02 10:T=1 12:T=0 20:T=1 20:next?23 22:irq?00 23:irq?01
        17.1   the edge counts that is selected when it comes out | 1:TCCRB=06 20:T=1 21:TCCRB=07 23:TCNT?01
        10.7   an edge in sleep is seen after it           | 1:TCCRB=07 10:sleep 20:T=1 40:wake 42:TCNT?00 43:TCNT?01
        10.7   a pulse in sleep is not                     | 1:TCCRB=07 10:sleep 20:T=1 30:T=0 40:wake 60:TCNT?00
        ",
    );
}

#[test]
fn a_16_bit_timer_counts() {
    check(
        TimerShape::wide(2),
        "
        16.3   TEMP: high byte first when writing          | 1:TCNTH=12 2:TCNTL=34 3:TCNTL!34 4:TCNTH!12
        16.3   TEMP: reading low latches high              | 1:TCNTH=12 2:TCNTL=FF 3:TCNTL!FF 4:TCCRB=01 9:TCNTH!12 9:TCNTL!03 10:TCNTH!13
        16.3   OCR reads go past TEMP                      | 1:OCRAH=12 2:OCRAL=34 3:TCNTH=77 4:OCRAH!12 5:OCRAL!34 6:TCNTH!77
        16.3   TEMP is shared                              | 1:OCRAH=12 2:OCRBL=34 3:OCRBH?12 3:OCRAH?00
        16.3   a read of TCNT is no poll while TEMP changes| 1:TCNTH=12 2:TCNTL=34 3:ICRH=00 4:steady.TCNTL?4 4:TCNTL!34 5:steady.TCNTL?-
        16.9.2 CTC with OCR1A                              | 1:OCRAH=01 2:OCRAL=2C 3:TCCRB=09 304:TCNTL?2C 304:TIFR?04 305:TCNTL?00 305:TIFR?06
        16.9.2 CTC with ICR1 sets ICF1                     | 1:TCCRB=18 2:ICRH=00 3:ICRL=09 4:OCRAL=FF 5:TCCRB=19 15:TCNTL?09 15:TIFR?04 16:TCNTL?00 16:TIFR?24
        16.6   ICR1 is written in any mode, on silicon     | 1:ICRH=12 2:ICRL=34 3:ICRL!34 4:ICRH!12 4:TCCRB=18 5:ICRH=56 6:ICRL=78 7:ICRL!78 8:ICRH!56
        16.9.4 mode 1: OCR has eight bits                  | 1:TCCRA=01 2:OCRAH=18 3:OCRAL=6A 4:OCRAL?6A 4:OCRAH?00 5:OCRBH=FF 6:OCRBL=FF 7:OCRBL?FF 7:OCRBH?00
        16.9.4 modes 2 and 3: nine and ten bits            | 1:TCCRA=02 2:OCRAH=FF 3:OCRAL=34 4:OCRAH?01 5:TCCRA=03 6:OCRAH=FF 7:OCRAL=34 8:OCRAH?03
        16.9.3 modes 5, 6, 7: eight, nine and ten bits     | 1:TCCRB=08 2:TCCRA=01 3:OCRBH=FF 4:OCRBL=34 5:OCRBH?00 6:TCCRA=02 7:OCRBH=FF 8:OCRBL=34 9:OCRBH?01 10:TCCRA=03 11:OCRBH=FF 12:OCRBL=34 13:OCRBH?03
        16.9.3 other modes have them all                   | 1:OCRAH=FF 2:OCRAL=34 3:OCRAH?FF 4:TCCRB=18 5:TCCRA=02 6:OCRAH=FE 7:OCRAL=34 8:OCRAH?FE 9:TCCRA=03 10:OCRAH=FD 11:OCRAL=34 12:OCRAH?FD
        16.9.4 what was written before keeps its bits      | 1:OCRAH=03 2:OCRAL=E8 3:TCCRA=01 4:OCRAL?E8 4:OCRAH?03
        16.3   the mask acts on TEMP: a low byte alone     | 1:TCCRA=01 2:ICRH=19 3:ICRL=64 4:OCRAL=6A 5:OCRAL?6A 5:OCRAH?19 6:OCRAH=19 7:TCNTH?00
        16.9.1 normal mode: TOV1                           | 1:TCCRB=01 8:TCNTH=FF 9:TCNTL=FE 12:TIFR?07 13:TCNTL?01
        16.9.3 fast PWM, nine bits                         | 1:TCCRA=02 2:TCCRB=09 3:TIFR=FF 8:TCNTH=01 9:TCNTL=FE 11:TCNTL?FF 11:TIFR&01=00 12:TCNTL!00 12:TIFR&01=01 13:TCNTH!00
        16.9.3 fast PWM, ten bits: above TOP it runs on    | 1:TCCRA=03 2:TCCRB=09 8:TCNTH=04 9:TCNTL=00 19:TCNTL!09 20:TCNTH!04
        16.12  interrupts: capture, A, B, overflow         | 1:TIMSK=FF 2:TIMSK?27 3:TCCRB=41 5:irq?06 10:ICP=1 13:irq?07 13:take=0 13:irq?06 20:TCNTH=FF 21:TCNTL=FF 23:irq?0E 23:take=3 23:TIFR?06
        16.11  bits that are kept                          | 1:TCCRA=FF 2:TCCRB=FF 3:TCCRC=FF 4:TCCRA?F3 4:TCCRB?DF 4:TCCRC?00
        ",
    );
    check(
        TimerShape::wide(3),
        "
        ATmega128 channel C                                | 1:TCCRA=0C 2:OCRCH=00 3:OCRCL=04 4:TIMSK=FF 5:TIMSK?2F 6:TIFR=FF 7:TCCRB=01 8:OCC?0 12:OCC?0 13:OCC?1 13:TIFR?0E 13:irq?0E
        ATmega128 overflow comes after C                   | 1:TIMSK=01 2:TCNTH=FF 3:TCNTL=FF 4:TCCRB=01 6:irq?10
        ",
    );
}

#[test]
fn input_capture() {
    // TCNT is c - 2 in the cycle c.
    check(
        TimerShape::wide(2),
        "
        16.6   a rising edge, the count before the edge    | 1:TCCRB=41 20:ICP=1 22:TIFR?06 23:TIFR?26 23:ICRL!14 24:ICRH!00
        16.6   a falling edge                              | 1:TCCRB=01 20:ICP=1 30:ICP=0 32:TIFR?06 33:TIFR?26 33:ICRL?1E
        16.6.2 the noise canceller is four cycles later    | 1:TCCRB=C1 20:ICP=1 26:TIFR?06 27:TIFR?26 27:ICRL?18
        16.6.2 three samples are noise                     | 1:TCCRB=C1 20:ICP=1 23:ICP=0 60:TIFR?06
        16.6.2 four are not                                | 1:TCCRB=C1 20:ICP=1 24:ICP=0 26:TIFR?06 27:TIFR?26
        16.6.2 noise does not hide a falling edge          | 1:TCCRB=81 20:ICP=1 40:ICP=0 43:ICP=1 50:ICP=0 56:TIFR?06 57:TIFR?26 57:ICRL?36
        16.6.3 the next capture overwrites ICR             | 1:TCCRB=41 20:ICP=1 30:ICP=0 40:ICP=1 43:ICRL?28
        16.3   ICR is read through TEMP                    | 1:TCCRB=41 4:TCNTH=12 5:TCNTL=00 20:ICP=1 24:ICRL!10 25:TCNTL!13 26:ICRH!12
        16.6   a stopped timer captures as well            | 1:TCCRB=40 2:TCNTH=00 3:TCNTL=77 20:ICP=1 23:ICRL?77 23:TIFR?20
        16.6   ICP is off where ICR is TOP                 | 1:TCCRB=58 2:ICRL=99 20:ICP=1 30:TIFR?00 30:ICRL?99
        16.6   the deadline of an enabled capture          | 1:TCCRB=40 2:TIMSK=20 20:next?- 20:ICP=1 20:next?23 23:irq?01
        16.6   one that others listen to                   | 1:TCCRB=40 2:listen=01 20:ICP=1 23:flag?0
        ",
    );
}
