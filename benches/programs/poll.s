; Waits for overflows of timer 0 (prescaler 1024) in an endless loop; r20 counts them.
        ldi  r16, 0x05
        out  0x25, r16          ; TCCR0B: clk/1024
        ldi  r17, 0x01
; wait
        in   r18, 0x15          ; TIFR0
        sbrs r18, 0             ; TOV0
        rjmp .-6                ; to wait
        out  0x15, r17          ; writing 1 clears it
        inc  r20
        rjmp .-12               ; to wait
