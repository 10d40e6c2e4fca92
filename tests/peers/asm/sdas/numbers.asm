; chip: 8051
; Numbers in every form, operators and their precedence, forward references.
        .module numbers
        .area   CSEG (ABS,CODE)
five    = 5
Five    = 50                        ; labels keep their case
fifty   .equ    0x32
        .equ    other, 7
moving  = 1
        .org    0x0100
start:  .db     0, 1, 9, 10, 99, 255, 08, 010
        .db     0x0, 0xF, 0xff, 0XFF, 0x7f, $$1F, 0h1F
        .db     0b0, 0b1, 0b11111111, 0o17, 0q377, 0d12
        .db     'a, 'Z, ' , '0, 'a'
        .byte   -1, -128, -five, -(five+1), ~five
        .dw     0, 0x1234, 65535, start, finish, five+Five*2
        .word   0x00FF, fifty, other
        mov     a, #five+Five
        mov     a, #five*2+1
        mov     a, #1+five*2
        mov     a, #20-5-3
        mov     a, #100/5/2
        mov     a, #100/5*2
        mov     a, #7%4*2
        mov     a, #1+2&3
        mov     a, #3&1+2
        mov     a, #1|6*2
        mov     a, #6*2|1
        mov     a, #5^1|8
        mov     a, #5|8^1
        mov     a, #6&3^1
        mov     a, #1<<2+1
        mov     a, #1+1<<2
        mov     a, #0x80>>3&0x1F
        mov     a, #(1+2)*(3+4)
        mov     a, #((((five))))
        mov     a, #-3+five
        mov     a, #-3*-2
        mov     a, #<0x1234
        mov     a, #>0x1234
        mov     a, #<start
        mov     a, #>start
        mov     a, #<finish
        mov     a, #>finish
        mov     a, #(finish >> 8)
        mov     a, #finish-start
        mov     dptr, #finish+1
        mov     dptr, #(finish - start) * 2
        mov     five, #Five
        mov     five+1, Five-1
        mov     r0, #moving
moving  = moving+1
        mov     r0, #moving
moving  = moving*4
        mov     r0, #moving
        .radix  x
        mov     a, #10
        .radix  d
        mov     a, #10
        sjmp    .
        sjmp    .+2
        sjmp    .-2
        ljmp    .+3
        .dw     ., .
finish: .dw     finish-.
