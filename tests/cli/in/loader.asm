; A boot loader of 512 bytes at 0x7E00 (word 0x3F00) that starts the program at 0; there is none.
        .device ATmega328P
        .org    0x3F00
        in      r20, PORTB
        inc     r20
        out     PORTB, r20
        cpi     r20, 3
        breq    done
        jmp     0
done:   rjmp    done
