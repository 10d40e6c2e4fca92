; chip: 8051
; Values with their signs, and escapes in texts.
        .org 0
        .byte -5000/256, -7 % 3
        .word -7/2
        .byte "a\n\"b", '\n', "\\"
l:      .byte "\t"
        mov a,#'\n'
        .equ  x, -5000/256
        .byte x
        mov     th1, #(-922 / 256) & 255
        mov     a, #(-922 % 256) & 255
        anl     a, #((-922) >> 3) & 255
        cpl     p1
        mov     a, ti
