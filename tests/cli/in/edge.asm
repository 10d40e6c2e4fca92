; r20 has ICR1, written in mode 1, r22 and r23 OCR1A; then power-down until PD2 falls, which counts in r21.
        rjmp    start
        nop
        inc     r21             ; INT0
        reti
start:  ldi     r16, 1
        sts     0x80, r16       ; TCCR1A: mode 1
        ldi     r16, 0x19
        sts     0x87, r16
        ldi     r16, 0x64
        sts     0x86, r16       ; ICR1 = 6500
        lds     r20, 0x86
        ldi     r16, 0x6A
        sts     0x88, r16       ; OCR1AL alone
        lds     r22, 0x88
        lds     r23, 0x89
        ldi     r16, 2
        sts     0x69, r16       ; EICRA: falling edge
        ldi     r16, 1
        out     0x1D, r16       ; EIMSK: INT0
        ldi     r16, 5
        out     0x33, r16       ; SMCR: SE, power-down
        sei
        sleep
        cli
end:    rjmp    end
