; Sleeps, and turns the lamp at P1.0 every 100 ms: timer 0 wakes it every 10 ms at 12 MHz. Needs a CMOS chip, for idle mode.
;
;   emu run examples/8051/blink.hex --mcu at89s52 --clock 12MHz --for 1s --vcd blink.vcd
        ljmp main
        .org 0x0B
        mov  TH0, #0xD8         ; -10,000
        mov  TL0, #0xF0
        djnz R7, back
        mov  R7, #10
        cpl  P1.0
back:   reti
main:   mov  R7, #10
        mov  TMOD, #0x01
        mov  TH0, #0xD8
        mov  TL0, #0xF0
        mov  IE, #0x82
        setb TR0
sleep:  orl  PCON, #0x01
        sjmp sleep
