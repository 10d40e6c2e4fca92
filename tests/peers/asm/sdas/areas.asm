; chip: 8052
; Areas of all kinds, which the linker places; bits of bytes; low bytes of addresses.
        .module areas
        .globl  main, count
        .area   REG_BANK_0 (REL,OVR,DATA)
        .ds     8
        .area   BIT_BANK (REL,OVR,DATA)
bits:   .ds     1
b0      = bits[0]
b7      = bits[7]
        .area   DSEG (DATA)
count:  .ds     2
        .area   OSEG (OVR,DATA)
one:    .ds     1
        .area   OSEG (OVR,DATA)
two:    .ds     3
        .area   ISEG (DATA)
buffer: .ds     90
        .area   SSEG
stack:  .ds     1
        .area   IABS (ABS,DATA)
        .org    0x7E
fixed:  .ds     2
        .area   BSEG (BIT)
        .ds     9
flag:   .ds     1
        .area   PSEG (PAG,XDATA)
page:   .ds     3
        .area   XSEG (XDATA)
large:  .ds     300
        .area   XABS (ABS,XDATA)
        .org    0x80
hole:   .ds     4
        .area   VECT (ABS,CODE)
        .org    0
        ljmp    main
        .org    0x0B
        reti
        .area   HOME (CODE)
home:   .db     1
        .area   GSFINAL (CODE)
        .db     2
        .area   GSINIT (CODE)
        .db     3
        .area   GSINIT0 (CODE)
        .db     4
        .area   CSEG (CODE)
        .ds     0x134
main:   mov     sp,#stack-1
        mov     b0,c
        setb    b7
        setb    flag
        clr     acc.3
        jb      a.6,main
        mov     count,#main
        mov     (count + 1),#(main >> 8)
        mov     r0,#buffer+1
        mov     dptr,#(large + 260)
        mov     a,#large
        mov     a,#>hole
        mov     one,two+2
        mov     a,fixed
        .db     #page, main, >main, 5
        .dw     home, tab, large
        .area   CONST (CODE)
        .db     5
        .even
tab:    .db     6
        .odd
        .db     7
        .area   HOME
        .db     8
