        ; INT0 at its low level comes again and again, and raises PB0 in the end.
        jmp     start
        jmp     low0
.org 0x100
start:  sbi     0x04, 0
        ldi     r16, 1
        out     0x1D, r16       ; EIMSK: INT0
        sei
loop:   rjmp    loop
low0:   inc     r20
        brne    done
        sbi     0x05, 0
done:   reti
