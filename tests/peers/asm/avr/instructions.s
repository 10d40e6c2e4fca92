; chip: atmega328p
; Every form of every instruction, with operands at the edges of what they may hold.
first:  nop
; Two registers, one register.
        add     r0, r0
        add     r31, r31
        add     r0, r31
        add     r31, r0
        add     r15, r16
        adc     r0, r0
        adc     r31, r31
        adc     r0, r31
        adc     r31, r0
        adc     r15, r16
        sub     r0, r0
        sub     r31, r31
        sub     r0, r31
        sub     r31, r0
        sub     r15, r16
        sbc     r0, r0
        sbc     r31, r31
        sbc     r0, r31
        sbc     r31, r0
        sbc     r15, r16
        and     r0, r0
        and     r31, r31
        and     r0, r31
        and     r31, r0
        and     r15, r16
        or      r0, r0
        or      r31, r31
        or      r0, r31
        or      r31, r0
        or      r15, r16
        eor     r0, r0
        eor     r31, r31
        eor     r0, r31
        eor     r31, r0
        eor     r15, r16
        cpse    r0, r0
        cpse    r31, r31
        cpse    r0, r31
        cpse    r31, r0
        cpse    r15, r16
        cp      r0, r0
        cp      r31, r31
        cp      r0, r31
        cp      r31, r0
        cp      r15, r16
        cpc     r0, r0
        cpc     r31, r31
        cpc     r0, r31
        cpc     r31, r0
        cpc     r15, r16
        mov     r0, r0
        mov     r31, r31
        mov     r0, r31
        mov     r31, r0
        mov     r15, r16
        mul     r0, r0
        mul     r31, r31
        mul     r0, r31
        mul     r31, r0
        mul     r15, r16
        com     r0
        com     r15
        com     r16
        com     r31
        neg     r0
        neg     r15
        neg     r16
        neg     r31
        inc     r0
        inc     r15
        inc     r16
        inc     r31
        dec     r0
        dec     r15
        dec     r16
        dec     r31
        lsr     r0
        lsr     r15
        lsr     r16
        lsr     r31
        ror     r0
        ror     r15
        ror     r16
        ror     r31
        asr     r0
        asr     r15
        asr     r16
        asr     r31
        swap    r0
        swap    r15
        swap    r16
        swap    r31
        lsl     r0
        lsl     r15
        lsl     r16
        lsl     r31
        rol     r0
        rol     r15
        rol     r16
        rol     r31
        tst     r0
        tst     r15
        tst     r16
        tst     r31
        clr     r0
        clr     r15
        clr     r16
        clr     r31
        push    r0
        push    r15
        push    r16
        push    r31
        pop     r0
        pop     r15
        pop     r16
        pop     r31
; Constants.
        subi    r16, 0
        subi    r31, 255
        subi    r24, 128
        subi    r17, 127
        subi    r18, -1
        subi    r19, -128
        subi    r20, 'A'
        sbci    r16, 0
        sbci    r31, 255
        sbci    r24, 128
        sbci    r17, 127
        sbci    r18, -1
        sbci    r19, -128
        sbci    r20, 'A'
        andi    r16, 0
        andi    r31, 255
        andi    r24, 128
        andi    r17, 127
        andi    r18, -1
        andi    r19, -128
        andi    r20, 'A'
        ori     r16, 0
        ori     r31, 255
        ori     r24, 128
        ori     r17, 127
        ori     r18, -1
        ori     r19, -128
        ori     r20, 'A'
        cpi     r16, 0
        cpi     r31, 255
        cpi     r24, 128
        cpi     r17, 127
        cpi     r18, -1
        cpi     r19, -128
        cpi     r20, 'A'
        ldi     r16, 0
        ldi     r31, 255
        ldi     r24, 128
        ldi     r17, 127
        ldi     r18, -1
        ldi     r19, -128
        ldi     r20, 'A'
        sbr     r16, 0
        sbr     r31, 255
        sbr     r24, 128
        sbr     r17, 127
        sbr     r18, -1
        sbr     r19, -128
        sbr     r20, 'A'
        cbr     r16, 0
        cbr     r31, 255
        cbr     r24, 128
        cbr     r17, 127
        cbr     r20, 'A'
        ser     r16
        ser     r31
        adiw    r24, 0
        adiw    r24, 1
        adiw    r24, 32
        adiw    r24, 63
        adiw    r26, 0
        adiw    r26, 1
        adiw    r26, 32
        adiw    r26, 63
        adiw    r28, 0
        adiw    r28, 1
        adiw    r28, 32
        adiw    r28, 63
        adiw    r30, 0
        adiw    r30, 1
        adiw    r30, 32
        adiw    r30, 63
        sbiw    r24, 0
        sbiw    r24, 1
        sbiw    r24, 32
        sbiw    r24, 63
        sbiw    r26, 0
        sbiw    r26, 1
        sbiw    r26, 32
        sbiw    r26, 63
        sbiw    r28, 0
        sbiw    r28, 1
        sbiw    r28, 32
        sbiw    r28, 63
        sbiw    r30, 0
        sbiw    r30, 1
        sbiw    r30, 32
        sbiw    r30, 63
        movw    r0, r0
        movw    r30, r30
        movw    r0, r30
        movw    r24, r26
        muls    r16, r16
        muls    r31, r31
        muls    r16, r31
        mulsu   r16, r16
        mulsu   r23, r23
        mulsu   r16, r23
        mulsu   r20, r18
        fmul    r16, r16
        fmul    r23, r23
        fmul    r16, r23
        fmul    r20, r18
        fmuls   r16, r16
        fmuls   r23, r23
        fmuls   r16, r23
        fmuls   r20, r18
        fmulsu  r16, r16
        fmulsu  r23, r23
        fmulsu  r16, r23
        fmulsu  r20, r18
; Bits.
        bld     r0, 0
        bld     r31, 7
        bld     r16, 3
        bst     r0, 0
        bst     r31, 7
        bst     r16, 3
        sbrc    r0, 0
        sbrc    r31, 7
        sbrc    r16, 3
        sbrs    r0, 0
        sbrs    r31, 7
        sbrs    r16, 3
        sbi     0, 0
        sbi     31, 7
        sbi     16, 5
        cbi     0, 0
        cbi     31, 7
        cbi     16, 5
        sbic    0, 0
        sbic    31, 7
        sbic    16, 5
        sbis    0, 0
        sbis    31, 7
        sbis    16, 5
        bset    0
        bclr    0
        bset    1
        bclr    1
        bset    2
        bclr    2
        bset    3
        bclr    3
        bset    4
        bclr    4
        bset    5
        bclr    5
        bset    6
        bclr    6
        bset    7
        bclr    7
        sec
        clc
        sez
        clz
        sen
        cln
        sev
        clv
        ses
        cls
        seh
        clh
        set
        clt
        sei
        cli
; Loads and stores.
        ld      r0, X
        st      X, r0
        ld      r0, X+
        st      X+, r0
        ld      r0, -X
        st      -X, r0
        ld      r0, Y
        st      Y, r0
        ld      r0, Y+
        st      Y+, r0
        ld      r0, -Y
        st      -Y, r0
        ld      r0, Z
        st      Z, r0
        ld      r0, Z+
        st      Z+, r0
        ld      r0, -Z
        st      -Z, r0
        ldd     r0, Y+0
        std     Y+0, r0
        ldd     r0, Y+1
        std     Y+1, r0
        ldd     r0, Y+63
        std     Y+63, r0
        ldd     r0, Z+0
        std     Z+0, r0
        ldd     r0, Z+32
        std     Z+32, r0
        ldd     r0, Z+63
        std     Z+63, r0
        lds     r0, 0
        sts     0, r0
        lds     r0, 0x60
        sts     0x60, r0
        lds     r0, 0x100
        sts     0x100, r0
        lds     r0, 0xFFFF
        sts     0xFFFF, r0
        lpm     r0, Z
        lpm     r0, Z+
        in      r0, 0
        out     0, r0
        in      r0, 31
        out     31, r0
        in      r0, 32
        out     32, r0
        in      r0, 63
        out     63, r0
        ld      r25, X
        st      X, r25
        ld      r25, X+
        st      X+, r25
        ld      r25, -X
        st      -X, r25
        ld      r25, Y
        st      Y, r25
        ld      r25, Y+
        st      Y+, r25
        ld      r25, -Y
        st      -Y, r25
        ld      r25, Z
        st      Z, r25
        ld      r25, Z+
        st      Z+, r25
        ld      r25, -Z
        st      -Z, r25
        ldd     r25, Y+0
        std     Y+0, r25
        ldd     r25, Y+1
        std     Y+1, r25
        ldd     r25, Y+63
        std     Y+63, r25
        ldd     r25, Z+0
        std     Z+0, r25
        ldd     r25, Z+32
        std     Z+32, r25
        ldd     r25, Z+63
        std     Z+63, r25
        lds     r25, 0
        sts     0, r25
        lds     r25, 0x60
        sts     0x60, r25
        lds     r25, 0x100
        sts     0x100, r25
        lds     r25, 0xFFFF
        sts     0xFFFF, r25
        lpm     r25, Z
        lpm     r25, Z+
        in      r25, 0
        out     0, r25
        in      r25, 31
        out     31, r25
        in      r25, 32
        out     32, r25
        in      r25, 63
        out     63, r25
        ld      r31, X
        st      X, r31
        ld      r31, X+
        st      X+, r31
        ld      r31, -X
        st      -X, r31
        ld      r31, Y
        st      Y, r31
        ld      r31, Y+
        st      Y+, r31
        ld      r31, -Y
        st      -Y, r31
        ld      r31, Z
        st      Z, r31
        ldd     r31, Y+0
        std     Y+0, r31
        ldd     r31, Y+1
        std     Y+1, r31
        ldd     r31, Y+63
        std     Y+63, r31
        ldd     r31, Z+0
        std     Z+0, r31
        ldd     r31, Z+32
        std     Z+32, r31
        ldd     r31, Z+63
        std     Z+63, r31
        lds     r31, 0
        sts     0, r31
        lds     r31, 0x60
        sts     0x60, r31
        lds     r31, 0x100
        sts     0x100, r31
        lds     r31, 0xFFFF
        sts     0xFFFF, r31
        lpm     r31, Z
        in      r31, 0
        out     0, r31
        in      r31, 31
        out     31, r31
        in      r31, 32
        out     32, r31
        in      r31, 63
        out     63, r31
        lpm
        spm
; Jumps: itself, both ways, as far as they reach.
back0:
        brcs    .
        brcs    back0
        brcs    ahead0
ahead0:
back1:
        brcc    .
        brcc    back1
        brcc    ahead1
ahead1:
back2:
        breq    .
        breq    back2
        breq    ahead2
ahead2:
back3:
        brne    .
        brne    back3
        brne    ahead3
ahead3:
back4:
        brmi    .
        brmi    back4
        brmi    ahead4
ahead4:
back5:
        brpl    .
        brpl    back5
        brpl    ahead5
ahead5:
back6:
        brvs    .
        brvs    back6
        brvs    ahead6
ahead6:
back7:
        brvc    .
        brvc    back7
        brvc    ahead7
ahead7:
back8:
        brlt    .
        brlt    back8
        brlt    ahead8
ahead8:
back9:
        brge    .
        brge    back9
        brge    ahead9
ahead9:
back10:
        brhs    .
        brhs    back10
        brhs    ahead10
ahead10:
back11:
        brhc    .
        brhc    back11
        brhc    ahead11
ahead11:
back12:
        brts    .
        brts    back12
        brts    ahead12
ahead12:
back13:
        brtc    .
        brtc    back13
        brtc    ahead13
ahead13:
back14:
        brie    .
        brie    back14
        brie    ahead14
ahead14:
back15:
        brid    .
        brid    back15
        brid    ahead15
ahead15:
back16:
        brlo    .
        brlo    back16
        brlo    ahead16
ahead16:
back17:
        brsh    .
        brsh    back17
        brsh    ahead17
ahead17:
back18:
        rjmp    .
        rjmp    back18
        rjmp    ahead18
ahead18:
back19:
        rcall   .
        rcall   back19
        rcall   ahead19
ahead19:
        brbs    0, .+4
        brbc    0, .-2
        brbs    1, .+4
        brbc    1, .-2
        brbs    2, .+4
        brbc    2, .-2
        brbs    3, .+4
        brbc    3, .-2
        brbs    4, .+4
        brbc    4, .-2
        brbs    5, .+4
        brbc    5, .-2
        brbs    6, .+4
        brbc    6, .-2
        brbs    7, .+4
        brbc    7, .-2
        brne    .+126
        brne    .-128
        brcs    .+126
        brcs    .-128
        rjmp    .+4094
        rcall   .+4094
        rjmp    far
        rcall   far
        jmp     0
        call    0
        jmp     2
        call    2
        jmp     0x1234
        call    0x1234
        jmp     first
        call    first
        jmp     last
        call    last
        jmp     last+2
        call    last+2
        jmp     first+4
        call    first+4
        ijmp
        icall
        ret
        reti
        nop
        sleep
        wdr
        break
; Case of letters, and spaces.
        LDI R16,5
        Ldi r16 , 0x1F
        ld r0,x
        LD R0,X+
        st -y,R7
        ldd r5,y+5
        STD Z+7,R8
        MOV r0,R31
        clr XL
        clr xh
        ldi YL, 1
        ldi ZH, 2
        mov zl, yh
        .org    0x1000
far:    nop
        rjmp    .-4096
        rcall   .-4096
last:   nop
