        ; Sleeps until a byte comes.
        ldi     r16, 0x90
        sts     0xC1, r16       ; UCSR0B: RXCIE, RXEN
        ldi     r16, 1
        out     0x33, r16       ; SMCR: SE, idle
        sei
loop:   sleep
        rjmp    loop
