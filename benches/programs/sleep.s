; Sleeps (idle) between the overflows of timer 0, every 256 * 1024 cycles; r20 counts the wake-ups; the interrupt has no effect.
        rjmp .+64               ; to main
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        nop
        reti                    ; word 32: TIMER0_OVF
; main
        ldi  r16, 0x05
        out  0x25, r16          ; TCCR0B: clk/1024
        ldi  r16, 0x01
        sts  0x006E, r16        ; TIMSK0: TOIE0
        out  0x33, r16          ; SMCR: SE, idle
        sei
; loop
        sleep
        inc  r20
        rjmp .-6                ; to loop
