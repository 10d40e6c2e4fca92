; chip: 8052
; Registers and bits of the 8052 by name, in both cases.
        .area   CSEG (ABS,CODE)
        .org    0
        mov     a, ACC
        mov     acc, a
        mov     a, B
        mov     b, a
        mov     a, DPH
        mov     dph, a
        mov     a, DPL
        mov     dpl, a
        mov     a, IE
        mov     ie, a
        mov     a, IP
        mov     ip, a
        mov     a, P0
        mov     p0, a
        mov     a, P1
        mov     p1, a
        mov     a, P2
        mov     p2, a
        mov     a, P3
        mov     p3, a
        mov     a, PCON
        mov     pcon, a
        mov     a, PSW
        mov     psw, a
        mov     a, SBUF
        mov     sbuf, a
        mov     a, SCON
        mov     scon, a
        mov     a, SP
        mov     sp, a
        mov     a, TCON
        mov     tcon, a
        mov     a, TH0
        mov     th0, a
        mov     a, TH1
        mov     th1, a
        mov     a, TL0
        mov     tl0, a
        mov     a, TL1
        mov     tl1, a
        mov     a, TMOD
        mov     tmod, a
        mov     a, T2CON
        mov     t2con, a
        mov     a, RCAP2L
        mov     rcap2l, a
        mov     a, RCAP2H
        mov     rcap2h, a
        mov     a, TL2
        mov     tl2, a
        mov     a, TH2
        mov     th2, a
        setb    AC
        clr     ac
        setb    CY
        clr     cy
        setb    EA
        clr     ea
        setb    ES
        clr     es
        setb    ET0
        clr     et0
        setb    ET1
        clr     et1
        setb    EX0
        clr     ex0
        setb    EX1
        clr     ex1
        setb    F0
        clr     f0
        setb    IE0
        clr     ie0
        setb    IE1
        clr     ie1
        setb    INT0
        clr     int0
        setb    INT1
        clr     int1
        setb    IT0
        clr     it0
        setb    IT1
        clr     it1
        setb    OV
        clr     ov
        setb    P
        clr     p
        setb    PS
        clr     ps
        setb    PT0
        clr     pt0
        setb    PT1
        clr     pt1
        setb    PX0
        clr     px0
        setb    PX1
        clr     px1
        setb    RB8
        clr     rb8
        setb    REN
        clr     ren
        setb    RI
        clr     ri
        setb    RS0
        clr     rs0
        setb    RS1
        clr     rs1
        setb    RXD
        clr     rxd
        setb    SM0
        clr     sm0
        setb    SM1
        clr     sm1
        setb    SM2
        clr     sm2
        setb    TB8
        clr     tb8
        setb    TF0
        clr     tf0
        setb    TF1
        clr     tf1
        setb    TI
        clr     ti
        setb    TR0
        clr     tr0
        setb    TR1
        clr     tr1
        setb    TXD
        clr     txd
        setb    ET2
        clr     et2
        setb    PT2
        clr     pt2
        setb    TR2
        clr     tr2
        setb    EXEN2
        clr     exen2
        setb    TCLK
        clr     tclk
        setb    RCLK
        clr     rclk
        setb    EXF2
        clr     exf2
        setb    TF2
        clr     tf2
        cpl     P0.0
        cpl     P0.3
        cpl     P0.7
        jbc     p0.5, .
        cpl     P1.0
        cpl     P1.3
        cpl     P1.7
        jbc     p1.5, .
        cpl     P2.0
        cpl     P2.3
        cpl     P2.7
        jbc     p2.5, .
        cpl     P3.0
        cpl     P3.3
        cpl     P3.7
        jbc     p3.5, .
        cpl     TCON.0
        cpl     TCON.3
        cpl     TCON.7
        jbc     tcon.5, .
        cpl     SCON.0
        cpl     SCON.3
        cpl     SCON.7
        jbc     scon.5, .
        cpl     IE.0
        cpl     IE.3
        cpl     IE.7
        jbc     ie.5, .
        cpl     IP.0
        cpl     IP.3
        jbc     ip.5, .
        cpl     T2CON.0
        cpl     T2CON.3
        cpl     T2CON.7
        jbc     t2con.5, .
        cpl     PSW.0
        cpl     PSW.3
        cpl     PSW.7
        jbc     psw.5, .
        cpl     ACC.0
        cpl     ACC.3
        cpl     ACC.7
        jbc     acc.5, .
        cpl     B.0
        cpl     B.3
        cpl     B.7
        jbc     b.5, .
