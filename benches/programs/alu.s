; A busy ALU loop: a 32-bit sum and a 16-bit shift register with taps, no memory, one branch in 13 instructions.
        ldi  r16, 0x4D          ; r19:16: what is added every turn
        ldi  r17, 0xC6
        ldi  r18, 0x35
        ldi  r19, 0x9E
        ldi  r24, 0x01          ; r25:24: the shift register, never 0
        ldi  r25, 0x00
        ldi  r20, 0xB4          ; its taps
; loop
        add  r0, r16            ; r3:0 += r19:16
        adc  r1, r17
        adc  r2, r18
        adc  r3, r19
        lsr  r25                ; r25:24 >>= 1
        ror  r24
        sbc  r21, r21           ; r21 = FF where a one fell out
        and  r21, r20
        eor  r25, r21
        mov  r4, r3
        eor  r4, r25            ; r4 mixes both
        inc  r22
        rjmp .-26               ; to loop
