; A program that wants RAM traced by simavr, says two chips, and whose last entry is longer than its section.
; avr-as -mmcu=atmega88 simram.asm -o simram.o && avr-ld -mavr4 -Tdata=0x800100 --section-start=.mmcu=0x910000 simram.o -o simram.elf
        .text
        .global main
main:   lds     r16, heap
        inc     r16
        sts     heap, r16
        rjmp    main
        .data
        .global heap
        .type   heap, @object
        .size   heap, 2
heap:   .word   0
        .space  2
        .section .note.gnu.avr.deviceinfo, "", @note
        .long   4, 0x2C, 1              ; lengths of name and contents, kind
        .ascii  "AVR\0"
        .long   0, 0x2000, 0x100, 0x400, 0, 0x200
        .long   8, 1                    ; table of names
        .ascii  "\0atmega88\0\0\0"
        .section .mmcu, "a"
        .byte   1, 64                   ; name
name:   .ascii  "ATmega16A"
        .space  64 - (. - name)
        .byte   18, 35, 0               ; two bytes of RAM
        .word   heap
        .space  32
        .byte   17, 35, 0               ; one byte
        .word   heap + 2
        .space  32
        .byte   17, 4, 0xFF, 0x0F, 'B', 0 ; a pull-up in simavr 1.6
        .byte   12, 64
        .ascii  "short"
