; chip: atmega16
#ifndef __SFR_OFFSET
        nop
#endif
#include <avr/io.h>

        .macro  store register bits
        ldi     r24, \bits
        out     \register, r24
        .endm

main:
        store   _SFR_IO_ADDR(PORTB), _BV(3)|_BV(4)
        ldi r30, PORTB
        ldi r31, __SFR_OFFSET
        lds r17, PORTB
        lds r18, _SFR_ADDR(PORTB)
        sbi PORTB - __SFR_OFFSET, 1
        sbi _SFR_IO_ADDR(DDRB), 5
        out _SFR_IO_ADDR(PORTD), r16
        lds r19, _SFR_MEM_ADDR(UDR)
        ldi r20, _SFR_IO8(0x05)
        ldi r21, _SFR_IO16(0x06)
        ldi r22, _BV(PB5) | _BV(3)
        out _SFR_MEM_ADDR(PINA), r0
        .byte PORTB, TCNT1L, __AVR_SFR_OFFSET__, 0
#if _SFR_IO_REG_P(PORTB) && __SFR_OFFSET == 0x20
        nop
#endif
#ifdef _SFR_ADDR
        sleep
#endif
