; chip: atmega328p
#define __SFR_OFFSET 0
#include <avr/io.h>

main:
        sbi DDRB, 5
        in r16, SREG
        ldi r30, PORTB
        ldi r31, __SFR_OFFSET
        lds r17, PORTB+0x20
        lds r18, UCSR0A
        out _SFR_IO_ADDR(PORTD), r16
        lds r19, _SFR_MEM_ADDR(UDR0)
        ldi r20, _SFR_IO8(0x05)
        ldi r21, _SFR_MEM8(0x25)
        ldi r22, _BV(PORTB5) | _BV(3)
        ldi r23, lo8(SPL)
        .byte PORTB, TCNT1L, TIFR0, GPIOR2
        .if PORTB < 0x20
        nop
        .endif
#if _SFR_IO_REG_P(PORTB) && !_SFR_IO_REG_P(UCSR0A)
        nop
#endif
#if defined(__SFR_OFFSET) && __SFR_OFFSET == 0
        nop
#endif
#ifdef _SFR_ADDR
        sleep
#endif
