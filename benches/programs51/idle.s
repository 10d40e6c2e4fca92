; Sleeps; timer 0 wakes it every 10,000 cycles, at 12 MHz 100 times per second. 30h and 31h count the wake-ups.
        ljmp main
        .org 0x0B
        clr  TR0
        mov  TL0, #0xF0         ; -10,000
        mov  TH0, #0xD8
        setb TR0
        reti
main:   mov  0x30, #0
        mov  0x31, #0
        mov  SP, #0x40
        mov  TMOD, #0x01
        mov  TH0, #0xD8
        mov  TL0, #0xF0
        mov  IE, #0x82
        setb TR0
sleep:  orl  PCON, #0x01
        inc  0x30
        mov  A, 0x30
        jnz  sleep
        inc  0x31
        sjmp sleep
