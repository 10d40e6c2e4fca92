//! Timer 2 on its crystal (18.9): cases, one per line. At 100 kHz with a crystal of 10 kHz, TOSC1 rises at
//! 10, 20, 30, ..

use emu_avr::periph::timers::TimerShape;

use crate::script::check;

#[test]
fn on_the_crystal() {
    let text = "
        18.9   a write is latched by two edges of TOSC1    | 1:ASSR=20 2:ASSR?20 2:TCCRB=01 3:TCCRB?01 3:ASSR?21 19:ASSR?21 20:ASSR?20 29:TCNT?00 30:TCNT?01 40:TCNT?02
        18.9   an edge at the write's own edge is no first | 1:ASSR=20 9:TCCRB=01 29:ASSR?21 30:ASSR?20 40:TCNT?01
        18.11.8 each register has its busy bit             | 1:ASSR=20 2:TCNT=01 3:OCRA=02 4:OCRB=03 5:TCCRA=40 6:TCCRB=01 7:ASSR?3F 20:ASSR?20
        18.9   flags are three cycles later                | 1:ASSR=20 2:TCCRB=01 3:OCRA=01 32:TIFR?00 33:TIFR?04 42:TIFR?04 43:TIFR?06
        18.9   so are interrupts                           | 1:ASSR=20 2:TCCRB=01 3:OCRA=01 4:TIMSK=02 40:next?43 42:irq?00 43:irq?01
        18.9   the pin is not                              | 1:ASSR=20 2:TCCRB=01 3:OCRA=01 4:TCCRA=40 19:OCA?- 20:OCA?0 39:OCA?0 40:OCA?1
        18.9   OCR reads its temporary register            | 1:ASSR=20 2:TCCRB=01 3:OCRA=09 4:OCRA?09 5:OCRA=08 6:OCRA?08 6:ASSR?29
        18.9   TCNT                                        | 1:ASSR=20 2:TCCRB=01 44:TCNT=80 45:TCNT?02 45:ASSR?30 59:TCNT?03 60:TCNT?80 70:TCNT?81
        18.9   a match is off while OCR is being written   | 1:ASSR=20 2:TCCRB=01 3:OCRA=01 34:OCRA=01 41:TIFR=FF 49:TIFR?00 59:TIFR?00
        18.9   a second write begins anew                  | 1:ASSR=20 2:OCRA=01 12:OCRA=02 20:ASSR?28 29:ASSR?28 30:ASSR?20
        18.9   asleep it counts on; TCNT is old until TOSC1 rises | 1:ASSR=20 2:TCCRB=01 44:sleep 55:wake 55:TCNT?02 59:TCNT?02 59:steady.TCNT?60 60:TCNT?04
        18.9   it wakes                                    | 1:ASSR=20 2:TCCRB=01 3:OCRA=06 4:TIMSK=02 44:sleep 50:next?90 92:irq?00 93:irq?01
        18.9   a write that sleep cuts short waits         | 1:ASSR=20 2:TCCRB=01 44:OCRA=05 46:sleep 75:wake 75:ASSR?28 89:ASSR?28 90:ASSR?20
        18.9   and there is no match meanwhile             | 1:ASSR=20 2:TCCRB=01 3:OCRA=06 4:TIMSK=02 44:OCRA=06 46:sleep 300:irq?00 300:TIFR?04
        18.10  the divider                                 | 1:ASSR=20 2:TCCRB=02 80:TCNT?01 159:TCNT?01 160:TCNT?02
        18.10  it is cleared by PSRASY                     | 1:ASSR=20 2:TCCRB=02 95:gtccr=02 169:TCNT?01 170:TCNT?02
        18.10  and held by TSM                             | 1:ASSR=20 2:TCCRB=02 85:gtccr=82 400:TCNT?01 401:gtccr=00 479:TCNT?01 480:TCNT?02
        18.11.8 EXCLK: a clock at TOSC1                    | 1:ASSR=60 2:TCCRB=01 10:T=1 12:T=0 19:ASSR?61 20:T=1 20:ASSR?60 22:T=0 30:TCNT?00 30:T=1 30:TCNT?01 99:TCNT?01
        18.9   AS2 off: the I/O clock again                | 1:ASSR=20 2:TCCRB=01 25:ASSR=00 26:TCNT?00 27:TCNT?01 36:TCNT?0A
        18.9   AS2 switched: what is on its way arrives    | 1:ASSR=20 2:OCRA=55 3:TCNT=44 4:ASSR=00 5:ASSR?00 5:OCRA?55 5:TCNT?44
        10.7   power-down stops the oscillator             | 1:ASSR=20 2:TCCRB=01 45:sleep 45:osc=0 145:osc=1 145:wake 149:TCNT?02 150:TCNT?03
        9.12.2 another rate                                | 1:ASSR=20 2:TCCRB=01 45:rate=200000 45:TCNT?02 54:TCNT?02 55:TCNT?03 75:TCNT?04
        ";
    let lines: Vec<String> = text
        .lines()
        .filter(|line| line.contains('|'))
        .map(|line| line.replacen('|', "| 0:rate=100000 0:xtal=10000", 1))
        .collect();
    check(TimerShape::crystal(2), &lines.join("\n"));
}

#[test]
fn on_the_io_clock() {
    check(
        TimerShape::crystal(2),
        "
        18.10  timer 2 divides by 32 and 128               | 1:TCCRB=03 32:TCNT?01 64:TCNT?02 65:TCNT=00 65:TCCRB=05 127:TCNT?00 128:TCNT?01
        18.7.2 timer 2 in CTC                              | 1:OCRA=02 2:TCCRA=02 3:TCCRB=01 6:TCNT?02 7:TCNT?00 7:TIFR?06 7:TIMSK=02 8:irq?01
        18.11.8 bits that are kept                         | 1:ASSR=9F 2:ASSR?00 3:ASSR=40 4:ASSR?40
        32.768 kHz at 1 MHz: the second edge is at 61.04   | 1:ASSR=20 2:TCCRB=01 61:ASSR?21 62:ASSR?20 91:TCNT?00 92:TCNT?01
        ",
    );
}
