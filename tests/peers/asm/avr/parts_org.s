; chip: atmega8
; `.org` in subsections: it counts from the start of the whole section.
        .text   0
        .byte   1
        .text   1
        .byte   2
        .org    8
        .byte   3
        .text   0
        .byte   4, 5
        .text   2
        .org    14
        .byte   6
        .data   1
        .byte   7
        .org    5
        .byte   8
        .data   0
        .byte   9
        .section .progmem.gcc.x,"a",@progbits
        .byte   10, 11
        .subsection 3
        .org    7
        .byte   12
