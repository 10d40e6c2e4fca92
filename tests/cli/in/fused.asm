; Fuse bytes and lock bits in an ELF file: the oscillator on the chip divided by 8, brown-out reset at 2.7 V.
; avr-as -mmcu=atmega328p -o fused.o fused.asm && avr-ld -mavr5 -o fused.elf fused.o
        .text
        .global main
main:   rjmp    main
        .section .fuse, "a"
        .byte   0x62, 0xD9, 0xFD
        .section .lock, "a"
        .byte   0xCC
