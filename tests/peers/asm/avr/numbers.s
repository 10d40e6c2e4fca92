; chip: atmega328p
; Numbers in every form, operators and their precedence, parts of numbers and addresses, the location counter.
        .equ    five, 5
        .set    moving, 1
sum = five + 50 * 2
Five = 50                           ; names keep their case
        .byte   0, 1, 9, 10, 255, 0x0, 0xF, 0xff, 0XFF, 0b0, 0b11111111, 0B101
        .byte   00, 07, 010, 017, 0377
        .byte   'a', 'Z', ' ', '0', '\n', '\\', '\'', 'a
        .byte   -1, -128, -five, -(five+1), ~five, sum
        .word   0x1234, 65535, -1, -32768, sum, start, finish
        .long   0x12345678, -1, start
        .balign 2
        ldi     r16, five + Five
        ldi     r16, five*2+1
        ldi     r16, 1+five*2
        ldi     r16, 20-5-3
        ldi     r16, 100/5/2
        ldi     r16, 100/5*2
        ldi     r16, 7%4*2
        ldi     r16, 1+2&3
        ldi     r16, 3&1+2
        ldi     r16, 2*3&1
        ldi     r16, 1|6*2
        ldi     r16, 6*2|1
        ldi     r16, 5^1|8
        ldi     r16, 8|5^1
        ldi     r16, 6&3^1
        ldi     r16, 1^6&3
        ldi     r16, 1<<2+1
        ldi     r16, 1+1<<2
        ldi     r16, 1<<2*3
        ldi     r16, 0x80>>3
        ldi     r16, (1+2)*(3+4)
        ldi     r16, ((((five))))
        ldi     r16, -3+five
        ldi     r16, -3*-2
        ldi     r16, ~5
        ldi     r16, !5
        ldi     r16, !0
        ldi     r16, -(5)
        ldi     r16, 3 == 3
        ldi     r16, 3 == 4
        ldi     r16, 3 != 4
        ldi     r16, 3 <> 3
        ldi     r16, 3 < 4
        ldi     r16, 3 > 4
        ldi     r16, 4 >= 4
        ldi     r16, 5 <= 4
        ldi     r16, 2 && 1
        ldi     r16, 0 && 1
        ldi     r16, 0 || 0
        ldi     r16, 4 || 0
        ldi     r16, 1 + 2 == 3
        ldi     r16, 'A' + 1
        ldi     r16, lo8(0x1234)
        ldi     r16, hi8(0x1234)
        ldi     r16, hh8(0x123456)
        ldi     r16, hlo8(0x123456)
        ldi     r16, hhi8(0x12345678)
        ldi     r16, lo8(-(five))
        ldi     r16, hi8(-(five))
        ldi     r16, hi8(-1000)
        ldi     r16, lo8(sum)
        ldi     r30, lo8(finish)
        ldi     r31, hi8(finish)
        ldi     r16, hh8(finish)
        ldi     r16, lo8(finish + 300)
        ldi     r16, hi8(finish-start)
        ldi     r16, lo8(finish - start)
        ldi     r30, pm_lo8(finish)
        ldi     r31, pm_hi8(finish)
        ldi     r16, pm_hh8(finish)
        ldi     r30, lo8(pm(finish))
        ldi     r31, hi8(pm(finish))
        ldi     r30, lo8(gs(finish))
        ldi     r31, hi8(gs(finish))
        subi    r30, lo8(-(sum))
        sbci    r31, hi8(-(sum))
        cpi     r16, lo8(300)
        adiw    r30, five
        ldd     r16, Y + five
        std     Z + five * 2, r16
        in      r16, 0x3F
        sbi     0x05, five
        lds     r16, 0x100 + five
        sts     0x100 + moving, r16
        .set    moving, moving + 1
        sts     0x100 + moving, r16
moving = moving * 4
        sts     0x100 + moving, r16
start:
        rjmp    .
        rjmp    .+2
        rjmp    .-2
        rjmp    start
        rjmp    start + 2
        rjmp    finish - 2
        breq    .+6
        jmp     finish + 2
        call    start
        .word   ., . - start, finish - .
        .word   pm(finish), gs(start)
        .byte   lo8(start), hi8(start), lo8(finish), 0
finish:
        ret
        nop
