; chip: at89s52
; A program as people write them, in the habits of sdas: a clock counted by timer 2, shown in packed decimal.
        .module clock
        .optsdcc -mmcs51
        .globl  _main
hundredths = 0x30
seconds = 0x31
minutes = 0x32
reload  = 65536 - 9216
        .area   VECTORS (ABS,CODE)
        .org    0
        ljmp    _main
        .org    0x2B
        ljmp    tick
        .area   CODE (ABS,CODE)
        .org    0x40
        .macro  bump cell, most, ?done
        mov     a, cell
        add     a, #1
        da      a
        mov     cell, a
        cjne    a, #most, done
        mov     cell, #0
done:
        .endm
_main:: mov     sp, #0x60
        mov     RCAP2H, #>reload
        mov     RCAP2L, #<reload
        mov     TH2, #(reload >> 8)
        mov     TL2, #reload & 0xFF
        setb    TR2
        setb    ET2
        setb    EA
        clr     a
        mov     hundredths, a
        mov     seconds, a
        mov     minutes, a
00001$: mov     P1, seconds
        mov     P2, minutes
        mov     a, hundredths
        swap    a
        anl     a, #0x0F
        mov     dptr, #segments
        movc    a, @a+dptr
        mov     P0, a
        sjmp    00001$
tick:   clr     TF2
        push    acc
        push    psw
        bump    hundredths, 0x00
        mov     a, hundredths
        jnz     00002$
        bump    seconds, 0x60
        mov     a, seconds
        jnz     00002$
        bump    minutes, 0x60
00002$: pop     psw
        pop     acc
        reti
segments:
        .db     0x3F, 0x06, 0x5B, 0x4F, 0x66, 0x6D, 0x7D, 0x07, 0x7F, 0x6F
