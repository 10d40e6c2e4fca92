; chip: at89s52
; Conditions with a word for the comparison.
        .module conditions
        .optsdcc -mmcs51 --model-small
        .area   HOME (ABS,CODE)
        .org    0
N = 4
eq = 1
        .if gt,N-3
        .db 1
        .endif
        .if eq,0
        .db 2
        .else
        .db 3
        .endif
        .if lt,N-9
        .db 4
        .endif
        .if GE , N-4
        .db 5
        .endif
        .if le N
        .db 6
        .else
        .db 7
        .endif
        .if ne,N
        .db 8
        .endif
        .if eq+1
        .db 9
        .endif
        .if gt,0x80000000
        .db 10
        .endif
        .if lt 0xFFFFFFFF
        .db 11
        .endif
        .iif eq,0 .db 12
        .iif eq 0 .db 13
        .iif ne,1 .db 14
        .iif eq,0,.db 15
        .iif gt,1 ,.db 16
        .iif lt -1 .db 17
        .iif eq,1 .db 18
        .iif 1 .db 19
        .iif ge,0 nop
        .iif le,0 mov a,#eq
        .iif GT,0 .db 20
        .ifgt 0x80000000
        .db 21
        .endif
        .iiflt 0x80000000 .db 22
        .db 23
