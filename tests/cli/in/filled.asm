; avr-as -mmcu=atmega328p filled.asm -o filled.o && avr-ld -m avr5 -Tdata=0x800100 -e 0 filled.o -o filled.elf
; avr-objcopy --change-section-lma .data=0x800100 filled.elf && avr-strip -g filled.elf
; Reads a byte of RAM that the file fills, then one that it does not fill.
        .global main
        .text
main:   lds r16, cell
        lds r17, bcell
done:   rjmp done
        .data
cell:   .byte 7, 8
        .section .bss
bcell:  .skip 2
