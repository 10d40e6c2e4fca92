; chip: atmega8
; Addresses that count from the start of a section, and characters that are no parameters.
        .section .progmem.x,"a",@progbits
        .byte 1, 2, 3
        .text
main:   nop
        .org 0x10
        .word main, ., . - main
        .data
        .byte 1
        .org 5
        .byte 2
        .text
        .macro chars n
        .byte '\n', '\n'+1
        .ascii "\n"
        .byte \n
        .balign 2
        .endm
        chars 8
        .irp t, 5, 6
        .byte '\t', \t
        .endr
