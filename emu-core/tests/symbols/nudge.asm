        .module nudge
        .globl _asm_nudge, nudges
        .area RSEG (ABS,DATA)
port = 0xA0
        .area REG_BANK_0 (REL,OVR,DATA)
        .ds 8
        .area BSEG (BIT)
nudged: .ds 1
        .area DSEG (DATA)
nudges: .ds 1
        .area CSEG (CODE)
limit = 5
_asm_nudge::
        inc nudges
        setb nudged
1$:     mov a, nudges
        cjne a, #limit, 2$
        ret
2$:     jc done
        mov nudges, #0
done:   mov port, a
        ret
text:   .ascii "more bytes than fit a line"
