; chip: atmega16
; Data, space, strings, files, sections, repeats, conditions, macros, labels of all kinds.
# A comment of its own line.
/* And one
   over two lines. */
        .section .data
        .global count
count:  .byte   1
buffer: .skip   8
        .section .bss
flags:  .space  1
pairs:  .zero   4
last:   .byte   0
        .section .text
        .global main
        .type   main, @function
        .org    0
        rjmp    main
        .org    0x20
text:   .ascii  "plain", "two"
        .asciz  "closed"
        .string "and so"
        .ascii  "a\n\t\r\\\"\0\101\x41"
        .balign 2
table:  .word   main, text, table, more
        .hword  1
        .short  2
        .2byte  3
        .long   4
        .4byte  5
        .int    6
        .skip   3, 0xAA
        .space  3
        .zero   2
        .fill   3, 2, 0x55
        .fill   2
more:   .byte   more - table, 1, 2 , 3
        .align  2
        .p2align 3
        .balign 16
        .org    0x100
main:   lds     r16, count
        ldi     r28, lo8(buffer)
        ldi     r29, hi8(buffer)
        ldi     r30, lo8(pairs)
        sts     flags, r16
        sts     last + 1, r16
        .include "tick.inc"
        .rept   3
        lsl     r16
        .endr
        .irp    reg, r0, r1, r31
        push    \reg
        .endr
        .irpc   digit, 975
        .byte   \digit
        .endr
        .byte   0
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
        .elseif 2 > 1
        inc     r16
        .else
        ret
        .endif
        .ifdef  main
        inc     r17
        .endif
        .ifndef nowhere
        inc     r18
        .endif
        .ifnotdef nowhere
        inc     r18
        .endif
        .ifeq   0
        inc     r19
        .endif
        .ifne   2
        inc     r20
        .endif
        .ifgt   1
        inc     r21
        .endif
        .iflt   1
        ret
        .endif
        .ifge   0
        inc     r22
        .endif
        .ifle   0
        inc     r23
        .endif
        .ifc    abc, abc
        inc     r24
        .endif
        .ifnc   abc, abd
        inc     r25
        .endif
        .macro  load which, value=0x55
        ldi     \which, \value
        .endm
        load    r16, 1
        load    r17
        load    r18 2
        load    value=3, which=r19
        load    r20, (1 + 2)
        .macro  wait n
        ldi     r24, \n
wait\@: dec     r24
        brne    wait\@
        .endm
        wait    10
        wait    20
        .macro  steps n
        .if     \n
        .word   \n
        steps   (\n-1)
        .else
        .exitm
        .endif
        ret
        .endm
        steps   3
        .macro  both first, second:req
        load    \first, 1
        load    \second, 2
        .endm
        both    r20, r21
        .macro  all regs:vararg
        .irp    reg, \regs
        pop     \reg
        .endr
        .endm
        all     r5, r6, r7
        .macro  name stem
\stem\()_end:
        rjmp    \stem\()_end
        .endm
        name    a
        rjmp    a_end
1:      dec     r16
        brne    1b
        rjmp    1f
        nop
1:      brne    1b
        rjmp    2f
2:      ret
inner: again: .Llocal: rjmp .Llocal
        rjmp    again
temp = 16
        .set    other, 17
        mov     temp, other
        ldi     temp, 5
        nop $   inc temp
        .size   main, . - main
        .end
