; chip: atmega328p
; Names of registers and bits as the makers' header has them.
#include <avr/io.h>
#define LED     PORTB5
#define led_on  sbi _SFR_IO_ADDR(PORTB), LED
#ifndef F_CPU
#define F_CPU   16000000
#endif
        .text
        .global main
main:   sbi     _SFR_IO_ADDR(DDRB), DDB5
        ldi     r16, (1 << WGM01) | (1 << COM0A1)
        out     _SFR_IO_ADDR(TCCR0A), r16
        ldi     r16, (1 << CS01)|(1 << CS00)
        out     _SFR_IO_ADDR(TCCR0B), r16
        ldi     r16, F_CPU / 64 / 1000 - 1
        out     _SFR_IO_ADDR(OCR0A), r16
        ldi     r16, 1 << OCIE0A
        sts     _SFR_MEM_ADDR(TIMSK0), r16
        sts     TIMSK1, r16
        lds     r17, UCSR0A
        ldi     r16, lo8(RAMEND)
        out     _SFR_IO_ADDR(SPL), r16
        ldi     r16, hi8(RAMEND)
        out     _SFR_IO_ADDR(SPH), r16
        in      r0, _SFR_IO_ADDR(SREG)
        ldi     r28, lo8(RAMSTART)
        ldi     r29, hi8(RAMSTART)
        ldi     r16, _BV(UDRE0)
        sbrs    r17, UDRE0
        led_on
        cbi     _SFR_IO_ADDR(EECR), EEPE
        sbic    _SFR_IO_ADDR(PIND), PIND2
        sts     UBRR0H, r16
        sts     UBRR0L, r16
        sts     WDTCSR, r16
#if defined(LED) && LED == 5
        nop
#else
        ret
#endif
#undef LED
#ifdef LED
        ret
#endif
        rjmp    main
