; chip: 8052
; Space, strings, files, repeats, conditions, macros, labels of all kinds.
        .module directives
        .title  Directives
        .globl  main
        .area   DSEG (ABS,DATA)
        .org    0x30
count:  .ds     1
buffer: .blkb   8
pairs:  .blkw   2
after:  .ds     1
        .area   CSEG (ABS,CODE)
        .org    0x0000
        ljmp    main
        .org    0x000B
        .include "tick.inc"
        .org    0x0200
text:   .ascii  "plain"
        .ascii  /it's "so"/
        .asciz  "closed"
        .strz   "and so"
        .str    "open"
        .db     0
table:  .dw     main, text, table, more
        .fdb    1
        .fcb    2, 3
        .ds     3
more:   .byte   more - table
        .even
        .db     1
        .odd
        .db     2
        .rmb    2
        .rs     1
        .org    0x0100
main::  mov     count, #0
        mov     r0, #buffer
        mov     r1, #pairs
        mov     a, after
        .rept   3
        rl      a
        .endm
        .irp    what, 1, 2, 3+4
        .db     what
        .endm
        .irpc   digit, 975
        .db     digit
        .endm
        .if     1
        nop
        .else
        ret
        .endif
        .if     0
        .if     1
        ret
        .endif
        ret
        .else
        .if     later
        inc     a
        .endif
        .endif
        .ifeq   0
        inc     a
        .endif
        .ifne   2
        inc     r1
        .endif
        .ifgt   1
        inc     r2
        .endif
        .iflt   1
        ret
        .endif
        .ifge   0
        inc     r3
        .endif
        .ifle   0
        inc     r4
        .endif
        .macro  load which, value
        mov     which, #value
        .endm
        load    r5, 0x55
        load    a, <main
        load    @r0, 7
        .macro  wait n, ?l
        mov     r7, #n
l:      djnz    r7, l
        .endm
        wait    10
        wait    20
        .macro  steps n
        .if     n
        .db     n
        steps   n-1
        .else
        .mexit
        .endif
        .endm
        steps   3
        .macro  both first, second
        load    first, 1
        load    second, 2
        .endm
        both    r2, r3
1$:     djnz    r0, 1$
        sjmp    2$
        nop
2$:     nop
second: djnz    r0, 1$
1$:     sjmp    1$
a1:     b1:     nop
        ljmp    a1
alone:
        sjmp    alone
later   = 1
