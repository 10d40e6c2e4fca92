; chip: at89s52
; Every form of every instruction, with operands at the edges of what they may hold.
        .area   CSEG (ABS,CODE)
first:  nop
; Registers of the bank: all eight of each form.
        add     a,R0
        add     a,r1
        add     a,R2
        add     a,r3
        add     a,R4
        add     a,r5
        add     a,R6
        add     a,r7
        add     a,@R0
        add     a,@r1
        addc    a,R0
        addc    a,r1
        addc    a,R2
        addc    a,r3
        addc    a,R4
        addc    a,r5
        addc    a,R6
        addc    a,r7
        addc    a,@R0
        addc    a,@r1
        subb    a,R0
        subb    a,r1
        subb    a,R2
        subb    a,r3
        subb    a,R4
        subb    a,r5
        subb    a,R6
        subb    a,r7
        subb    a,@R0
        subb    a,@r1
        anl     a,R0
        anl     a,r1
        anl     a,R2
        anl     a,r3
        anl     a,R4
        anl     a,r5
        anl     a,R6
        anl     a,r7
        anl     a,@R0
        anl     a,@r1
        orl     a,R0
        orl     a,r1
        orl     a,R2
        orl     a,r3
        orl     a,R4
        orl     a,r5
        orl     a,R6
        orl     a,r7
        orl     a,@R0
        orl     a,@r1
        xrl     a,R0
        xrl     a,r1
        xrl     a,R2
        xrl     a,r3
        xrl     a,R4
        xrl     a,r5
        xrl     a,R6
        xrl     a,r7
        xrl     a,@R0
        xrl     a,@r1
        xch     a,R0
        xch     a,r1
        xch     a,R2
        xch     a,r3
        xch     a,R4
        xch     a,r5
        xch     a,R6
        xch     a,r7
        xch     a,@R0
        xch     a,@r1
        mov     a,R0
        mov     a,r1
        mov     a,R2
        mov     a,r3
        mov     a,R4
        mov     a,r5
        mov     a,R6
        mov     a,r7
        mov     a,@R0
        mov     a,@r1
        mov     R0,a
        mov     r1,a
        mov     R2,a
        mov     r3,a
        mov     R4,a
        mov     r5,a
        mov     R6,a
        mov     r7,a
        mov     @R0,a
        mov     @r1,a
        inc     R0
        inc     r1
        inc     R2
        inc     r3
        inc     R4
        inc     r5
        inc     R6
        inc     r7
        inc     @R0
        inc     @r1
        dec     R0
        dec     r1
        dec     R2
        dec     r3
        dec     R4
        dec     r5
        dec     R6
        dec     r7
        dec     @R0
        dec     @r1
        mov     r0,#0
        mov     r0,0
        mov     0,R0
        mov     r1,#1
        mov     r1,0x7F
        mov     0x7F,R1
        mov     r2,#127
        mov     r2,0x80
        mov     0x80,R2
        mov     r3,#128
        mov     r3,0xFF
        mov     0xFF,R3
        mov     r4,#255
        mov     r4,P1
        mov     P3,R4
        mov     r5,#-1
        mov     r5,sp
        mov     SP,R5
        mov     r6,#-127
        mov     r6,dph
        mov     DPL,R6
        mov     r7,#85
        mov     r7,b
        mov     B,R7
        mov     @r0,#0
        mov     @R0,0x7F
        mov     0,@r0
        xchd    a,@r0
        movx    a,@r0
        movx    @R0,a
        mov     @r1,#255
        mov     @R1,PSW
        mov     ACC,@r1
        xchd    a,@r1
        movx    a,@r1
        movx    @R1,a
; Direct addresses and constants.
        add     a,0
        addc    a,0
        subb    a,0
        anl     a,0
        orl     a,0
        xrl     a,0
        xch     a,0
        mov     a,0
        mov     0,a
        inc     0
        dec     0
        anl     0,a
        orl     0,a
        xrl     0,a
        push    0
        pop     0
        anl     0,#0
        orl     0,#0
        xrl     0,#0
        mov     0,#0
        anl     0,#255
        orl     0,#255
        xrl     0,#255
        mov     0,#255
        mov     0,0
        mov     0,TMOD
        mov     0,0xFF
        add     a,0x7F
        addc    a,0x7F
        subb    a,0x7F
        anl     a,0x7F
        orl     a,0x7F
        xrl     a,0x7F
        xch     a,0x7F
        mov     a,0x7F
        mov     0x7F,a
        inc     0x7F
        dec     0x7F
        anl     0x7F,a
        orl     0x7F,a
        xrl     0x7F,a
        push    0x7F
        pop     0x7F
        anl     0x7F,#0
        orl     0x7F,#0
        xrl     0x7F,#0
        mov     0x7F,#0
        anl     0x7F,#255
        orl     0x7F,#255
        xrl     0x7F,#255
        mov     0x7F,#255
        mov     0x7F,0
        mov     0x7F,TMOD
        mov     0x7F,0xFF
        add     a,0x80
        addc    a,0x80
        subb    a,0x80
        anl     a,0x80
        orl     a,0x80
        xrl     a,0x80
        xch     a,0x80
        mov     a,0x80
        mov     0x80,a
        inc     0x80
        dec     0x80
        anl     0x80,a
        orl     0x80,a
        xrl     0x80,a
        push    0x80
        pop     0x80
        anl     0x80,#0
        orl     0x80,#0
        xrl     0x80,#0
        mov     0x80,#0
        anl     0x80,#255
        orl     0x80,#255
        xrl     0x80,#255
        mov     0x80,#255
        mov     0x80,0
        mov     0x80,TMOD
        mov     0x80,0xFF
        add     a,P0
        addc    a,P0
        subb    a,P0
        anl     a,P0
        orl     a,P0
        xrl     a,P0
        xch     a,P0
        mov     a,P0
        mov     P0,a
        inc     P0
        dec     P0
        anl     P0,a
        orl     P0,a
        xrl     P0,a
        push    P0
        pop     P0
        anl     P0,#0
        orl     P0,#0
        xrl     P0,#0
        mov     P0,#0
        anl     P0,#255
        orl     P0,#255
        xrl     P0,#255
        mov     P0,#255
        mov     P0,0
        mov     P0,TMOD
        mov     P0,0xFF
        add     a,SBUF
        addc    a,SBUF
        subb    a,SBUF
        anl     a,SBUF
        orl     a,SBUF
        xrl     a,SBUF
        xch     a,SBUF
        mov     a,SBUF
        mov     SBUF,a
        inc     SBUF
        dec     SBUF
        anl     SBUF,a
        orl     SBUF,a
        xrl     SBUF,a
        push    SBUF
        pop     SBUF
        anl     SBUF,#0
        orl     SBUF,#0
        xrl     SBUF,#0
        mov     SBUF,#0
        anl     SBUF,#255
        orl     SBUF,#255
        xrl     SBUF,#255
        mov     SBUF,#255
        mov     SBUF,0
        mov     SBUF,TMOD
        mov     SBUF,0xFF
        add     a,0xFF
        addc    a,0xFF
        subb    a,0xFF
        anl     a,0xFF
        orl     a,0xFF
        xrl     a,0xFF
        xch     a,0xFF
        mov     a,0xFF
        mov     0xFF,a
        inc     0xFF
        dec     0xFF
        anl     0xFF,a
        orl     0xFF,a
        xrl     0xFF,a
        push    0xFF
        pop     0xFF
        anl     0xFF,#0
        orl     0xFF,#0
        xrl     0xFF,#0
        mov     0xFF,#0
        anl     0xFF,#255
        orl     0xFF,#255
        xrl     0xFF,#255
        mov     0xFF,#255
        mov     0xFF,0
        mov     0xFF,TMOD
        mov     0xFF,0xFF
        add     a,#0
        addc    a,#0
        subb    a,#0
        anl     a,#0
        orl     a,#0
        xrl     a,#0
        mov     a,#0
        add     a,#1
        addc    a,#1
        subb    a,#1
        anl     a,#1
        orl     a,#1
        xrl     a,#1
        mov     a,#1
        add     a,#127
        addc    a,#127
        subb    a,#127
        anl     a,#127
        orl     a,#127
        xrl     a,#127
        mov     a,#127
        add     a,#128
        addc    a,#128
        subb    a,#128
        anl     a,#128
        orl     a,#128
        xrl     a,#128
        mov     a,#128
        add     a,#255
        addc    a,#255
        subb    a,#255
        anl     a,#255
        orl     a,#255
        xrl     a,#255
        mov     a,#255
        add     a,#-1
        addc    a,#-1
        subb    a,#-1
        anl     a,#-1
        orl     a,#-1
        xrl     a,#-1
        mov     a,#-1
        add     a,#-127
        addc    a,#-127
        subb    a,#-127
        anl     a,#-127
        orl     a,#-127
        xrl     a,#-127
        mov     a,#-127
        mov     dptr,#0
        mov     dptr,#0x00FF
        mov     dptr,#0x0100
        mov     dptr,#0x7FFF
        mov     dptr,#0x8000
        mov     dptr,#65535
        mov     dptr,#first
        mov     dptr,#last
; The accumulator, carry and bits.
        mul     ab
        div     ab
        da      a
        clr     a
        cpl     a
        rl      a
        rlc     a
        rr      a
        rrc     a
        swap    a
        inc     a
        dec     a
        inc     dptr
        clr     c
        setb    c
        cpl     c
        MUL     AB
        Inc     Dptr
        clr     0
        setb    0
        cpl     0
        anl     c,0
        anl     c,/0
        orl     c,0
        orl     c,/0
        mov     c,0
        mov     0,c
        clr     0x7F
        setb    0x7F
        cpl     0x7F
        anl     c,0x7F
        anl     c,/0x7F
        orl     c,0x7F
        orl     c,/0x7F
        mov     c,0x7F
        mov     0x7F,c
        clr     0x80
        setb    0x80
        cpl     0x80
        anl     c,0x80
        anl     c,/0x80
        orl     c,0x80
        orl     c,/0x80
        mov     c,0x80
        mov     0x80,c
        clr     0xFF
        setb    0xFF
        cpl     0xFF
        anl     c,0xFF
        anl     c,/0xFF
        orl     c,0xFF
        orl     c,/0xFF
        mov     c,0xFF
        mov     0xFF,c
        clr     P1.0
        setb    P1.0
        cpl     P1.0
        anl     c,P1.0
        anl     c,/P1.0
        orl     c,P1.0
        orl     c,/P1.0
        mov     c,P1.0
        mov     P1.0,c
        clr     P1.7
        setb    P1.7
        cpl     P1.7
        anl     c,P1.7
        anl     c,/P1.7
        orl     c,P1.7
        orl     c,/P1.7
        mov     c,P1.7
        mov     P1.7,c
        clr     ACC.7
        setb    ACC.7
        cpl     ACC.7
        anl     c,ACC.7
        anl     c,/ACC.7
        orl     c,ACC.7
        orl     c,/ACC.7
        mov     c,ACC.7
        mov     ACC.7,c
        clr     B.0
        setb    B.0
        cpl     B.0
        anl     c,B.0
        anl     c,/B.0
        orl     c,B.0
        orl     c,/B.0
        mov     c,B.0
        mov     B.0,c
        clr     PSW.5
        setb    PSW.5
        cpl     PSW.5
        anl     c,PSW.5
        anl     c,/PSW.5
        orl     c,PSW.5
        orl     c,/PSW.5
        mov     c,PSW.5
        mov     PSW.5,c
        clr     EA
        setb    EA
        cpl     EA
        anl     c,EA
        anl     c,/EA
        orl     c,EA
        orl     c,/EA
        mov     c,EA
        mov     EA,c
        clr     TR0
        setb    TR0
        cpl     TR0
        anl     c,TR0
        anl     c,/TR0
        orl     c,TR0
        orl     c,/TR0
        mov     c,TR0
        mov     TR0,c
        clr     RI
        setb    RI
        cpl     RI
        anl     c,RI
        anl     c,/RI
        orl     c,RI
        orl     c,/RI
        mov     c,RI
        mov     RI,c
        clr     0x90
        setb    0x90
        cpl     0x90
        anl     c,0x90
        anl     c,/0x90
        orl     c,0x90
        orl     c,/0x90
        mov     c,0x90
        mov     0x90,c
; Program memory, external memory, the ways out.
        movc    a,@a+dptr
        movc    a,@a+pc
        movx    a,@dptr
        movx    @dptr,a
        jmp     @a+dptr
        ret
        reti
        nop
; Relative targets: itself, both ways, and as far as they reach.
        jc      .
back0:
        nop
        jc      back0
        jc      ahead0
        nop
ahead0:
        nop
        jnc     .
back1:
        nop
        jnc     back1
        jnc     ahead1
        nop
ahead1:
        nop
        jz      .
back2:
        nop
        jz      back2
        jz      ahead2
        nop
ahead2:
        nop
        jnz     .
back3:
        nop
        jnz     back3
        jnz     ahead3
        nop
ahead3:
        nop
        sjmp    .
back4:
        nop
        sjmp    back4
        sjmp    ahead4
        nop
ahead4:
        nop
        jb      P1.0,.
back5:
        nop
        jb      P1.0,back5
        jb      P1.0,ahead5
        nop
ahead5:
        nop
        jnb     ACC.0,.
back6:
        nop
        jnb     ACC.0,back6
        jnb     ACC.0,ahead6
        nop
ahead6:
        nop
        jbc     TF0,.
back7:
        nop
        jbc     TF0,back7
        jbc     TF0,ahead7
        nop
ahead7:
        nop
        cjne    a,P2,.
back8:
        nop
        cjne    a,P2,back8
        cjne    a,P2,ahead8
        nop
ahead8:
        nop
        cjne    a,#0xFF,.
back9:
        nop
        cjne    a,#0xFF,back9
        cjne    a,#0xFF,ahead9
        nop
ahead9:
        nop
        cjne    r0,#0,.
back10:
        nop
        cjne    r0,#0,back10
        cjne    r0,#0,ahead10
        nop
ahead10:
        nop
        cjne    R7,#255,.
back11:
        nop
        cjne    R7,#255,back11
        cjne    R7,#255,ahead11
        nop
ahead11:
        nop
        cjne    @r0,#1,.
back12:
        nop
        cjne    @r0,#1,back12
        cjne    @r0,#1,ahead12
        nop
ahead12:
        nop
        cjne    @r1,#-1,.
back13:
        nop
        cjne    @r1,#-1,back13
        cjne    @r1,#-1,ahead13
        nop
ahead13:
        nop
        djnz    r0,.
back14:
        nop
        djnz    r0,back14
        djnz    r0,ahead14
        nop
ahead14:
        nop
        djnz    R7,.
back15:
        nop
        djnz    R7,back15
        djnz    R7,ahead15
        nop
ahead15:
        nop
        djnz    0x30,.
back16:
        nop
        djnz    0x30,back16
        djnz    0x30,ahead16
        nop
ahead16:
        nop
        djnz    B,.
back17:
        nop
        djnz    B,back17
        djnz    B,ahead17
        nop
ahead17:
        nop
far:    nop
        .ds     125
        sjmp    far
        sjmp    away
        .ds     127
away:   nop
; The page of two kilobytes is that of the next instruction.
        .org    0x07FA
        acall   page0
        ajmp    page0
        nop
        nop
page1:  nop
        .org    0x1010
at0:    ajmp    at7
        acall   at0
        acall   at0+3
        .org    0x1110
at1:    ajmp    at6
        acall   at1
        acall   at1+3
        .org    0x1210
at2:    ajmp    at5
        acall   at2
        acall   at2+3
        .org    0x1310
at3:    ajmp    at4
        acall   at3
        acall   at3+3
        .org    0x1410
at4:    ajmp    at3
        acall   at4
        acall   at4+3
        .org    0x1510
at5:    ajmp    at2
        acall   at5
        acall   at5+3
        .org    0x1610
at6:    ajmp    at1
        acall   at6
        acall   at6+3
        .org    0x1710
at7:    ajmp    at0
        acall   at7
        acall   at7+3
page0   = 0x0123
; Jumps anywhere.
        .org    0xFF00
        ljmp    0
        lcall   0
        ljmp    0x1234
        lcall   0x1234
        ljmp    0xFFFF
        lcall   0xFFFF
        ljmp    first
        lcall   first
        ljmp    last
        lcall   last
        .org    0xFFFC
last:   ljmp    first
