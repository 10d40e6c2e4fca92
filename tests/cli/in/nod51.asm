        ; Idles, and takes timer 0 down when P3.2 falls.
        ljmp    start
        .org    3
        mov     0x41, TH0
        mov     0x40, TL0
        reti
        .org    0x30
start:  mov     TMOD, #1
        setb    TR0
        mov     IE, #0x81
        setb    IT0
loop:   orl     PCON, #1
        sjmp    loop
