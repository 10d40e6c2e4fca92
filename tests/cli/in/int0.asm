        ; Sleeps until PD2 falls, and counts in r20.
        jmp     start
        jmp     pressed
.org 0x100
start:  ldi     r16, 1
        out     0x1D, r16       ; EIMSK: INT0
        ldi     r16, 2
        sts     0x69, r16       ; EICRA: falling edge
        ldi     r16, 1
        out     0x33, r16       ; SMCR: SE, idle
        sei
loop:   sleep
        inc     r20
        rjmp    loop
pressed:
        inc     r21
        reti
