; A busy loop under an interrupt of timer 0 every 16,000 cycles (1 kHz at 16 MHz) that counts milliseconds in four bytes at
; data 0x0200, low byte first.
        rjmp .+110               ; to main
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
        push r24                ; word 28: TIMER0_COMPA
        in   r24, 0x3F          ; SREG
        push r24
        push r25
        lds  r24, 0x0200
        lds  r25, 0x0201
        adiw r24, 1
        sts  0x0200, r24
        sts  0x0201, r25
        brne .+18               ; to end, without a carry
        lds  r24, 0x0202
        lds  r25, 0x0203
        adiw r24, 1
        sts  0x0202, r24
        sts  0x0203, r25
; end
        pop  r25
        pop  r24
        out  0x3F, r24
        pop  r24
        reti
; main
        ldi  r16, 0x00
        sts  0x0200, r16
        sts  0x0201, r16
        sts  0x0202, r16
        sts  0x0203, r16
        ldi  r16, 249
        out  0x27, r16          ; OCR0A: 250 timer clocks
        ldi  r16, 0x02
        out  0x24, r16          ; TCCR0A: CTC
        sts  0x006E, r16        ; TIMSK0: OCIE0A
        ldi  r16, 0x03
        out  0x25, r16          ; TCCR0B: clk/64
        ldi  r18, 0x01          ; r19:18: a shift register, never 0
        ldi  r19, 0x00
        ldi  r20, 0xB4          ; its taps
        sei
; loop
        lsr  r19
        ror  r18
        sbc  r21, r21
        and  r21, r20
        eor  r19, r21
        add  r0, r18
        adc  r1, r19
        inc  r22
        brne .-18               ; to loop
        rjmp .-20
