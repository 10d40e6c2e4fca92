; chip: 8052
; Where things stand: origins in any order, space, strings, files, flags, names of registers and bits of the 8052.
        .flag   ready, 0x20.1
        .flag   top, ACC.7
        .flag   lamp, P1.3
        .equ    buffer, 0x30
        .equ    flags, 0x2F
        .org    0
        ljmp    main
        .org    0x000B
        .inc    "tick.inc"
        .org    0x0200
text:   .byte   "plain", 0
        .byte   "tab\tand\nline\rand \"quote\"", 0
        .byte   "it's; no comment", 0    ; but this is
        .byte   'x', "y", 'z', 1, 2 , 3
table:  .word   main, text, table, more
        .skip   3
more:   .byte   more-table
        .org    0x0100
main:   setb    ready
        clr     top
        jb      lamp, main
        cpl     flags.0
        mov     c, flags.7
        MOV     T2CON, #4
        mov     tl2, #0
        mov     th2, #-1
        mov     rcap2l, #1
        mov     RCAP2H, #2
        setb    TR2
        setb    et2
        clr     PT2
        clr     TF2
        clr     exf2
        setb    RCLK
        setb    TCLK
        setb    EXEN2
        mov     a, ACC
        mov     a, B
        mov     a, DPH
        mov     a, DPL
        mov     a, IE
        mov     a, IP
        mov     a, P0
        mov     a, P1
        mov     a, P2
        mov     a, P3
        mov     a, PCON
        mov     a, PSW
        mov     a, SBUF
        mov     a, SCON
        mov     a, SP
        mov     a, TCON
        mov     a, TH0
        mov     a, TH1
        mov     a, TL0
        mov     a, TL1
        mov     a, TMOD
        setb    AC
        setb    CY
        setb    EA
        setb    ES
        setb    ET0
        setb    ET1
        setb    EX0
        setb    EX1
        setb    F0
        setb    IE0
        setb    IE1
        setb    INT0
        setb    INT1
        setb    IT0
        setb    IT1
        setb    OV
        setb    P
        setb    PS
        setb    PT0
        setb    PT1
        setb    PX0
        setb    PX1
        setb    RB8
        setb    RD
        setb    REN
        setb    RI
        setb    RS0
        setb    RS1
        setb    RXD
        setb    SM0
        setb    SM1
        setb    SM2
        setb    T0
        setb    T1
        setb    TB8
        setb    TF0
        setb    TF1
        setb    TI
        setb    TR0
        setb    TR1
        setb    TXD
        setb    WR
        MOVX    A,@DPTR
        mov a,#5
        mov a , # 5
        mov a,@r0
again:  djnz    r7,again
        djnz    r6 , again
alone:
        sjmp    alone
        jmp     @dptr+a
        movc    a,@dptr+a
        movc    a,@pc+a
        orl     c,!ready
        anl     c,!0x20.7
        .end
