        .text
main:   ldi  r16, 1
        rjmp main
        .section .eeprom,"a",@progbits
        .byte 1, 2, 3
