; chip: 8051
; Numbers in every form, operators, what stands between brackets, forward references.
        .equ    five, 5
        .equ    fifty, 50
        .equ    here, 0x0100
        .equ    sum, five+FIFTY*2
        .org    here
start:  .byte   0, 1, 9, 10, 99, 255, 08, 010
        .byte   0x0, 0xF, 0xff, 0XFF, 0x7f
        .byte   0h, 0FFh, 0ffH, 10h, 7FH
        .byte   0b0, 0b1, 0b11111111, 0B1010
        .byte   0b, 1b, 1010b, 11111111B
        .byte   0o, 17o, 377o, 377O
        .byte   0d, 129d, 255D
        .byte   'a', 'Z', ' ', '0', '\n', '\r', '\t', '\''
        .byte   -1, -127, -five, -(five+1)
        .word   0, 0x1234, 65535, -1, -32767, start, finish, sum
        mov     a, #five+fifty
        mov     a, #five*2+1
        mov     a, #1+five*2
        mov     a, #20-5-3
        mov     a, #100/5/2
        mov     a, #100/5*2
        mov     a, #7%4*2
        mov     a, #0x3C & 0x0F
        mov     a, #0x30 | 0x0F
        mov     a, #(1+2)*(3+4)
        mov     a, #((((five))))
        mov     a, #-3+five
        mov     a, #(1<<3)|1
        mov     a, #0x80>>3
        mov     a, #'A'+1
        mov     a, #start/256
        mov     a, #finish & 0xFF
        mov     a, #finish-start
        mov     dptr, #finish+1
        mov     dptr, #sum*2
        mov     five, #fifty
        mov     five+1, fifty-1
        sjmp    *
        sjmp    *+2
        sjmp    *-2
        ljmp    (*+3)
        .word   *, *
finish: .word   finish-*
        .end
