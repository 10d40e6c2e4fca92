; avr-as -mmcu=atmega328p main.asm -o main.o && avr-ld -m avr5 -Tdata=0x800100 -e 0 main.o -o main.elf && avr-strip -g main.elf
; A program with symbols: stores 7 in `cell` and halts.
        .global main, done, cell
        .text
        jmp main
main:   ldi r16, 7
        sts cell, r16
done:   rjmp done
        .section .bss
cell:   .skip 2
