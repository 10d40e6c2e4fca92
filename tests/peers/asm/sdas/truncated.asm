; chip: at89s52
; Labels beyond 255 as operands of 8 bits.
        .module truncated
        .area   HOME (ABS,CODE)
        .area   XABS (ABS,XDATA)
        .org    0x301
xv:     .ds     1
xw:     .ds     1
        .area   HOME (ABS,CODE)
        .org    0
        setb    xv
        mov     c,xv
        mov     a,code
        jb      xv,.
        anl     c,/xv
        mov     xv+1,xw
        push    xv
        djnz    xv,.
        cjne    a,xv,.
        mov     a,#xv
        mov     a,#>xv
        mov     dptr,#xv
        inc     xv+0x10
        mov     r1,xv
        xch     a,xv
        .org    0x234
code:   nop
