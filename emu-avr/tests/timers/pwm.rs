//! Output compare pins: cases from DS40002061, one per line; the section comes first.

use emu_avr::periph::timers::TimerShape;

use crate::script::check;

#[test]
fn pins_without_pwm() {
    check(
        TimerShape::narrow(2),
        "
        15.6   toggle                                      | 1:OCRA=05 2:TCCRA=40 3:TCCRB=01 3:OCA?0 9:OCA?0 10:OCA?1 265:OCA?1 266:OCA?0
        15.6   CTC and toggle: a square wave               | 1:OCRA=03 2:TCCRA=42 3:TCCRB=01 7:OCA?0 8:OCA?1 11:OCA?1 12:OCA?0 16:OCA?1
        15.6   set, and clear                              | 1:OCRA=05 2:OCRB=07 3:TCCRA=E0 4:TCCRB=01 10:OCA?0 11:OCA?1 13:OCB?0 14:TCCRA=B0 14:OCB?0 15:OCA?1 266:OCA?1 267:OCA?0 268:OCB?0 269:OCB?1
        15.6   COM 0 leaves the pin to the port            | 1:TCCRB=01 99:OCA?- 99:TCCRA=80 100:OCA?0 101:TCCRA=00 102:OCA?-
        15.6.1 force compare sets the pin up               | 1:TCCRA=C0 2:OCA?0 2:TCCRB=80 3:OCA?1 3:TCCRB?00 4:TIFR?00 4:TCCRA=00 5:OCA?- 5:TCCRA=80 6:OCA?1
        15.9.2 FOC toggles                                 | 1:TCCRA=50 2:TCCRB=80 3:OCA?1 3:OCB?0 3:TCCRB=C0 4:OCA?0 4:OCB?1
        15.9.2 FOC does nothing in PWM modes               | 1:TCCRA=C3 2:TCCRB=80 3:OCA?0
        15.9.2 FOC does not clear the timer in CTC mode    | 1:OCRA=09 2:TCCRA=42 3:TCCRB=01 5:TCCRB=81 6:OCA?1 6:TCNT?02 13:TCNT?09 13:TIFR?04
        15.5.2 the hidden match moves no pin               | 1:OCRA=20 2:TCCRA=40 3:TCCRB=01 9:TCNT=20 30:OCA?0
        ",
    );
    check(
        TimerShape::wide(2),
        "16.11.3 FOC1A and FOC1B in TCCR1C | 1:TCCRA=70 2:TCCRC=40 3:OCA?0 3:OCB?1 3:TCCRC=80 4:OCA?1 4:TIFR?00 5:TCCRB=08 6:TCCRC=80 7:OCA?0",
    );
}

#[test]
fn fast_pwm() {
    // TCNT is FE, FF, 0 in the cycles 10, 11, 12.
    check(
        TimerShape::narrow(2),
        "
        15.7.3 set at BOTTOM, cleared after the match      | 1:OCRA=02 2:TCCRA=83 3:TCCRB=01 8:TIFR=FF 9:TCNT=FE 11:OCA?0 11:TIFR?00 12:OCA?1 12:TIFR?01 13:TIFR?05 14:OCA?1 15:OCA?0 15:TIFR?07
        15.7.3 inverted                                    | 1:OCRA=02 2:TCCRA=C3 3:TCCRB=01 9:TCNT=FE 11:OCA?1 12:OCA?0 14:OCA?0 15:OCA?1
        15.7.3 OCR = BOTTOM is a spike of one clock        | 2:TCCRA=83 3:TCCRB=01 9:TCNT=FE 11:OCA?0 12:OCA?1 13:OCA?0 267:OCA?0 268:OCA?1 269:OCA?0
        15.7.3 OCR = MAX is constant                       | 1:OCRA=FF 2:TCCRA=83 3:TCCRB=01 9:TCNT=FE 12:OCA?1 267:OCA?1 268:OCA?1 300:OCA?1
        15.7.3 inverted, OCR = MAX                         | 1:OCRA=FF 2:TCCRA=C3 3:TCCRB=01 9:TCNT=FE 12:OCA?0 267:OCA?0 268:OCA?0 269:OCA?0
        15.7.3 OCR is buffered until BOTTOM                | 1:OCRA=02 2:TCCRA=83 3:TCCRB=01 9:TCNT=FE 13:OCRA=05 14:OCRA?05 15:OCA?0 18:OCA?0 268:OCA?1 273:OCA?1 274:OCA?0
        15.7.3 mode 7: TOP is OCRA, COM 1 toggles          | 1:OCRA=03 2:TCCRA=43 3:TCCRB=09 7:TCNT?03 7:TIFR?04 8:TCNT?00 8:TIFR?07
        15.7.3 mode 7: a wave of two periods               | 1:OCRA=03 2:TCCRA=43 3:TCCRB=09 7:OCA?0 8:OCA?1 11:OCA?1 12:OCA?0 16:OCA?1
        15.7.3 mode 7: TOP is buffered too                 | 1:OCRA=03 2:TCCRA=03 3:TCCRB=09 9:OCRA=01 11:TCNT?03 12:TCNT?00 13:TCNT?01 14:TCNT?00
        15.7.3 mode 7: above TOP to MAX, without TOV       | 1:OCRA=03 2:OCRB=80 3:TCCRA=23 4:TCCRB=09 6:TIFR=FF 7:TCNT=FE 10:TCNT?00 10:TIFR?00 10:OCB?0 13:TCNT?03 13:OCB?0 14:TCNT?00 14:OCB?1
        15.7.3 TOP = BOTTOM: a pulse of 5 from the match   | 1:TCCRA=33 2:TCCRB=09 4:OCRB=FB 9:TCNT=FA 11:OCB?0 12:OCB?1 15:TCNT?FF 16:TCNT?00 16:OCB?1 17:TCNT?00 17:OCB?0 300:OCB?0
        15.7.3 TOP = BOTTOM: and one of 1                  | 1:TCCRA=33 2:TCCRB=09 4:OCRB=FF 9:TCNT=FE 10:TCNT?FE 11:TCNT?FF 11:OCB?0 12:TCNT?00 12:OCB?1 13:OCB?0 300:OCB?0
        15.7.3 OCRB above TOP: the pin stays set           | 1:OCRA=03 2:OCRB=80 3:TCCRA=23 4:TCCRB=09 8:OCB?0 9:OCB?1 99:OCB?1
        15.9.1 COM 1 otherwise leaves the pin to the port  | 1:TCCRA=53 2:OCA?- 2:OCB?- 3:TCCRB=08 4:OCA?0 4:OCB?-
        15.9.1 back to CTC the buffered value acts         | 1:OCRA=50 2:TCCRA=03 3:TCCRB=01 4:OCRA=07 5:TCCRA=02 11:TCNT?07 12:TCNT?00
        ",
    );
    check(
        TimerShape::wide(2),
        "
        16.9.3 mode 14: ICR is TOP, ICF and TOV together   | 1:OCRAH=00 2:OCRAL=01 3:TCCRA=82 4:TCCRB=18 5:ICRH=00 6:ICRL=03 7:TIFR=FF 8:TCCRB=19 9:TCNTL?00 11:OCA?0 12:TIFR?06 13:TIFR?27 13:OCA?1 14:OCA?1 15:OCA?0 17:OCA?1
        16.9.3 mode 14: ICR is not buffered                | 3:TCCRA=02 4:TCCRB=18 5:ICRH=00 6:ICRL=05 7:TCCRB=19 9:ICRL=02 10:TCNTL?02 11:TCNTL?00
        16.11.1 modes 14 and 15 toggle with COM 1          | 1:OCRAL=01 2:TCCRA=52 3:TCCRB=18 4:OCA?0 4:OCB?- 5:ICRL=03 6:TCCRB=19 8:OCA?0 9:OCA?1 12:OCA?1 13:OCA?0 14:TCCRA=43 15:OCA?0 16:TCCRB=09 17:OCA?-
        "
    );
}

#[test]
fn phase_correct_pwm() {
    // TCNT is FD, FE, FF, FE in the cycles 10 to 13; 0 in 267, FF in 522.
    check(
        TimerShape::narrow(2),
        "
        15.7.4 symmetrical, TOV at BOTTOM                  | 1:OCRA=02 2:TCCRA=81 3:TCCRB=01 9:TCNT=FD 12:TCNT?FF 13:TCNT?FE 20:TIFR=FF 265:OCA?0 266:OCA?1 267:TCNT?00 267:TIFR?02 268:TCNT?01 268:TIFR?07 269:OCA?1 270:OCA?0
        15.7.4 inverted                                    | 1:OCRA=02 2:TCCRA=C1 3:TCCRB=01 9:TCNT=FD 13:OCA?1 265:OCA?1 266:OCA?0 269:OCA?0 270:OCA?1
        15.7.4 OCR = BOTTOM is low                         | 2:TCCRA=81 3:TCCRB=01 9:TCNT=FD 13:OCA?0 266:OCA?0 267:OCA?0 268:OCA?0 600:OCA?0
        15.7.4 OCR = MAX is high, and what follows falls at TOP | 1:OCRA=FF 2:TCCRA=81 3:TCCRB=01 9:TCNT=FD 12:OCA?0 13:OCA?1 100:OCRA=02 270:OCA?1 522:OCA?1 523:OCA?0 775:OCA?0 776:OCA?1
        15.7.4 a match missed on the way up: falls at TOP  | 1:OCRA=80 2:TCCRA=C0 3:TCCRB=80 4:TCCRA=81 5:TCCRB=01 9:TCNT=FD 12:OCA?1 13:OCA?0
        15.7.4 OCR is buffered until TOP                   | 1:OCRA=02 2:TCCRA=81 3:TCCRB=01 9:TCNT=FD 20:OCRA=04 265:OCA?0 266:OCA?1 270:OCA?0 522:TCNT?FF 773:OCA?0 774:OCA?1
        15.7.4 mode 5: TOP is OCRA, taken over at TOP      | 1:OCRA=04 2:TCCRA=01 3:TCCRB=09 6:OCRA=02 8:TCNT?04 9:TCNT?03 12:TCNT?00 14:TCNT?02 15:TCNT?01 16:TCNT?00
        15.7.4 mode 5: COM 1 toggles once a period         | 1:OCRA=03 2:TCCRA=41 3:TCCRB=09 7:OCA?0 8:OCA?1 13:OCA?1 14:OCA?0
        15.7.4 TCNT above TOP goes to MAX and round        | 1:OCRA=04 2:TCCRA=01 3:TCCRB=09 6:TCNT=FE 8:TCNT?FF 9:TCNT?00 13:TCNT?04 14:TCNT?03
        15.7.4 TCNT written on the way down goes on down   | 1:OCRA=04 2:TCCRA=01 3:TCCRB=09 9:TCNT=FE 11:TCNT?FD 264:TCNT?00 268:TCNT?04 269:TCNT?03
        15.7.4 TOP = BOTTOM stays there                    | 2:TCCRA=01 3:TCCRB=09 9:TCNT?00 9:TIFR?07
        "
    );
    check(
        TimerShape::wide(2),
        "
        16.9.5 mode 8: up and down, ICF at TOP             | 1:OCRAH=00 2:OCRAL=01 3:TCCRB=10 4:ICRH=00 5:ICRL=03 6:TCCRA=80 7:TCCRB=11 8:TIFR?00 9:TIFR?05 10:TIFR?07 11:TCNTL?03 11:TIFR?07 12:TCNTL?02 12:TIFR?27 13:OCA?0 14:OCA?1 15:OCA?1 16:OCA?0
        16.9.5 mode 8: OCR is buffered until BOTTOM        | 1:OCRAH=00 2:OCRAL=01 3:TCCRB=10 4:ICRH=00 5:ICRL=03 6:TCCRA=80 7:TCCRB=11 10:OCRAL=02 13:OCA?0 14:OCA?1 16:OCA?1 17:OCA?0
        16.9.5 mode 9: TOP is OCRA, buffered until BOTTOM  | 1:OCRAL=03 2:TCCRA=41 3:TCCRB=11 4:TCNTL?00 5:OCRAL=02 7:TCNTL?03 7:OCA?0 8:OCA?1 10:TCNTL?00 11:TCNTL?01 12:TCNTL?02 13:TCNTL?01 13:OCA?0
        16.9.4 mode 1: TOP is 00FF                         | 1:TCCRA=01 2:TCCRB=01 9:TCNTL=FE 11:TCNTL?FF 12:TCNTL?FE
        16.11.1 COM 1 in mode 8 leaves the pin to the port | 1:TCCRA=50 2:TCCRB=10 3:OCA?- 3:OCB?-
        "
    );
}
