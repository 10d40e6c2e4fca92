; Timer 0 overflows every 256 cycles; between, the program sleeps.
    rjmp start
.org 0x40
    inc  r20
    reti
start:
    ldi  r16, 1
    out  0x33, r16       ; SMCR: idle
    out  0x25, r16       ; TCCR0B: no prescaler
    sts  0x006E, r16     ; TIMSK0
    sei
wait:
    sleep
    rjmp wait
