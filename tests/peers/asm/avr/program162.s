; chip: atmega162
; A program as people write them: a list is sorted in place, in RAM, then sums are kept in the EEPROM.
        .set    RAMSTART, 0x100
        .set    count, 10
        .text
        jmp     reset
        .org    28 * 4
reset:  ldi     r16, lo8(RAMSTART + 0x3FF)
        out     0x3D, r16
        ldi     r16, hi8(RAMSTART + 0x3FF)
        out     0x3E, r16
        ldi     r30, lo8(unsorted)
        ldi     r31, hi8(unsorted)
        ldi     r26, lo8(list)
        ldi     r27, hi8(list)
        ldi     r17, count
1:      lpm     r0, Z+
        st      X+, r0
        dec     r17
        brne    1b
outer:  clr     r20
        ldi     r28, lo8(list)
        ldi     r29, hi8(list)
        ldi     r17, count - 1
inner:  ld      r0, Y
        ldd     r1, Y+1
        cp      r1, r0
        brsh    2f
        std     Y+1, r0
        st      Y, r1
        ser     r20
2:      adiw    r28, 1
        dec     r17
        brne    inner
        tst     r20
        brne    outer
        ldi     r28, lo8(list)
        ldi     r29, hi8(list)
        clr     r2
        clr     r3
        ldi     r17, count
3:      ld      r0, Y+
        add     r2, r0
        brcc    4f
        inc     r3
4:      dec     r17
        brne    3b
        sts     sum, r2
        sts     sum + 1, r3
        call    store
5:      sleep
        rjmp    5b
store:  sbic    0x1C, 1
        rjmp    store
        ldi     r16, lo8(total)
        out     0x1E, r16
        ldi     r16, hi8(total)
        out     0x1F, r16
        out     0x1D, r2
        sbi     0x1C, 2
        sbi     0x1C, 1
        ret
unsorted:
        .byte   9, 3, 7, 1, 200, 45, 0, 255, 12, 8
        .section .bss
list:   .space  count
sum:    .space  2
        .section .eeprom, "aw", @progbits
        .word   0xBEEF
total:  .byte   0
