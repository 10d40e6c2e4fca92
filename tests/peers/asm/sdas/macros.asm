; chip: 8051
; Arguments between blanks, quotes that join, values without signs, the accumulator on the stack.
        .area A (ABS,CODE)
        .org 0
        .dw (-1000/3) & 0xFFFF, (-7>>1) & 0xFFFF
        .db -7%3
        push a
        pop a
        mov a,#-1000
        mov r0,#0x1234
        .macro mk a1 b1
n'b1:   mov a,#a1
b1'_x:  .db b1 + 1
        .endm
        mk 5 q1
        .irp x 1,2,3
        .db x
        .endm
q1 = 3
        sjmp nq1
        .macro mv c
        mov a,#'c
        mov a,#'c'
        .db 'c
        .endm
        mv b
        .macro two a b
        .db a, b
        .endm
        two 1+2 3
