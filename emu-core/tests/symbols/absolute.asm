        .module absolute
        .area RSEG (ABS,DATA)
        .org 0x90
port:   .ds 1
        .area BSEG (BIT,ABS)
        .org 8
flag:   .ds 1
        .area XSEG (XDATA,ABS)
        .org 0x2000
buffer: .ds 16
        .area CSEG (CODE,ABS)
        .org 0x100
start:: mov a, #1
        .include "absolute.inc"
        .macro twice
        inc a
        .endm
        twice
        .if 0
        nop
        .endif
        ret
