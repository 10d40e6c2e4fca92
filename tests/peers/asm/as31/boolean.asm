; chip: 8051
; A rung as a compiler of ladder diagrams puts it for this family: (x and y) or (not x and not y), each step by carry.
        .flag   x, 0x20.0
        .flag   y, 0x20.1
        .flag   s0, 0x21.0
        .flag   s1, 0x21.1
        .flag   s2, 0x21.2
        .flag   s3, 0x21.3
        .flag   s4, 0x21.4
        .org    0
rung:   MOV C,x
        ANL C,y
        MOV s0,C
        MOV C,x
        CPL C
        MOV s1,C
        MOV C,y
        CPL C
        MOV s2,C
        MOV C,s1
        ANL C,s2
        MOV s3,C
        MOV C,s0
        ORL C,s3
        MOV s4,C
        MOV C,x
        ANL C,/y
        SJMP rung
        .end
