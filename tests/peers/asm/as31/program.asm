; chip: at89s52
; A program as people write them: a table of segments is shown digit by digit, a key steps, the serial port reports.
        .equ    digit, 0x30
        .equ    ticks, 0x31
        .equ    reload, 65536-1000
        .flag   pressed, 0x20.0

        .org    0
reset:  ljmp    begin
        .org    0x0B
timer:  push    ACC
        push    PSW
        mov     TH0, #reload/256
        mov     TL0, #reload%256
        djnz    ticks, quiet
        mov     ticks, #100
        cpl     P1.7
quiet:  pop     PSW
        pop     ACC
        reti
        .org    0x30
begin:  mov     SP, #0x5F
        mov     TMOD, #0x21
        mov     SCON, #0x50
        mov     TH1, #-3
        setb    TR1
        mov     TH0, #reload/256
        mov     TL0, #reload%256
        setb    TR0
        setb    ET0
        setb    EA
        mov     digit, #0
        mov     ticks, #100
        mov     dptr, #hello
        acall   say
show:   mov     a, digit
        mov     dptr, #segments
        movc    a, @a+dptr
        mov     P0, a
        jb      P3.2, released
        jb      pressed, show
        setb    pressed
        inc     digit
        mov     a, digit
        cjne    a, #10, report
        mov     digit, #0
report: mov     a, digit
        add     a, #'0'
        acall   send
        sjmp    show
released:
        clr     pressed
        sjmp    show
send:   mov     SBUF, a
        jnb     TI, *
        clr     TI
        ret
say:    clr     a
        movc    a, @a+dptr
        jz      said
        acall   send
        inc     dptr
        sjmp    say
said:   ret
segments:
        .byte   0x3F, 0x06, 0x5B, 0x4F, 0x66, 0x6D, 0x7D, 0x07, 0x7F, 0x6F
hello:  .byte   "digits", 13, 10, 0
        .end
