; A program with what simavr wants to know, and a section of odd length that no linker script has.
; avr-as -mmcu=atmega88 simavr.asm -o simavr.o && avr-ld -mavr4 --section-start=.mmcu=0x910000 simavr.o -o simavr.elf
        .text
        .global main
main:   ldi     r16, '!'
        out     0x1E, r16               ; GPIOR0
        rjmp    .-2
        .section .tag, "a"
        .ascii  "abc"
        .section .mmcu, "a"
        .byte   1, 64                   ; name
name:   .ascii  "atmega88"
        .space  64 - (. - name)
        .byte   2, 4                    ; frequency
        .long   8000000
        .byte   12, 64                  ; file of the waveform
file:   .ascii  "trace.vcd"
        .space  64 - (. - file)
        .byte   14, 35, 0               ; a register in it
        .word   0x25
trace:  .ascii  "PORTB"
        .space  32 - (. - trace)
        .byte   11, 2                   ; the console
        .word   0x3E
        .byte   0, 0
