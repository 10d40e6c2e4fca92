; chip: 8051
; monitor in the manner of PAULMON
.equ    locat, 0x0000
.equ    vector, 0x2000
.equ    stack, 0x30
.equ    psw_init, 0
.equ    baud_const, 256 - (11059200 / 12 / 16 / 9600) 
.equ    bmem, 0x1000
.equ    emem, 0xFFFF
.flag   busy, 0x20.3
.flag   upper, P1.7
        .org    locat
rst:    ljmp    poweron
        .org    locat+3
        ljmp    vector+3
        .org    locat+11
        ljmp    vector+11
        .org    locat+0x23
        ljmp    vector+0x23
        .org    locat+0x2E
        .byte   "Monitor",13,0
        .org    locat+0x40
        ajmp    cin
        ajmp    cout
        ajmp    phex
        ajmp    pstr
        ljmp    newline
poweron:
        mov     ie, #0
        mov     ip, #0
        mov     psw, #psw_init
        mov     sp, #stack
        mov     r0, #stack
        clr     a
rst2:   djnz    r0, rst2
        mov     TMOD, #0x21
        mov     TH1, #baud_const
        mov     tcon, #01000000b
        mov     SCON, #01010010b
        orl     PCON, #10000000b
        setb    busy
        mov     dptr, #logo
        lcall   pstr
menu:   acall   cin
        acall   upper_case
        mov     dptr, #cmd_tbl
menu1:  mov     b, a
        clr     a
        movc    a, @a+dptr
        jz      menu_end
        cjne    a, b, menu2
        inc     dptr
        clr     a
        movc    a, @a+dptr
        push    acc
        mov     a, #1
        movc    a, @a+dptr
        push    acc
        ret
menu2:  inc     dptr
        inc     dptr
        inc     dptr
        mov     a, b
        sjmp    menu1
menu_end:
        mov     a, #'?'
        acall   cout
        sjmp    menu
cmd_tbl:
        .db     'D'
        .dw     dump
        .db     'L'
        .dw     load
        .db     '?'
        .dw     help
        .db     0
cin:    jnb     ri, cin
        clr     ri
        mov     a, sbuf
        ret
cout:   jnb     ti, cout
        clr     ti
        mov     sbuf, a
        ret
newline:push    acc
        mov     a, #13
        acall   cout
        mov     a, #10
        acall   cout
        pop     acc
        ret
phex:   acall   phex_b
phex_b: swap    a
        acall   phex1
        swap    a
        ret
phex1:  push    acc
        anl     a, #15
        add     a, #0x90
        da      a
        addc    a, #0x40
        da      a
        acall   cout
        pop     acc
        ret
pstr:   push    acc
pstr1:  clr     a
        movc    a,@a+dptr
        inc     dptr
        jz      pstr2
        mov     c, acc.7
        anl     a, #0x7F
        acall   cout
        jc      pstr2
        ajmp    pstr1
pstr2:  pop     acc
        ret
upper_case:
        cjne    a, #97, up2
up2:    jc      up4
        cjne    a, #123, up3
up3:    jnc     up4
        add     a, #224
up4:    ret
dump:   mov     r2, #16
dump1:  mov     a, dpl
        acall   phex
        movx    a, @dptr
        inc     dptr
        djnz    r2, dump1
        ret
load:   cpl     busy
        jbc     busy, load1
        anl     c, /busy
        orl     c, upper
        mov     upper, c
load1:  ret
help:   mov     dptr, #help_str
        ljmp    pstr
logo:   .db     "Welcome",128+'!' , 13, 10
        .db     "\tTab\"quoted\"\\", 0
help_str:
        .db     31,"Dump", 149, -1
        .dw     logo + 2, -2, bmem, 'A', baud_const
        .skip   5
        .byte 1
        .end
