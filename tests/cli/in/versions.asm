        .device ATmega8A        ; its registers are those of ATmega8
        ldi     r16, 5
        sbi     0x17, 0         ; DDRB
loop:   rjmp    loop
