; Says hello over the serial port, 9600 baud at 11.0592 MHz, and stops.
;
;   emu run examples/8051/hello.hex --mcu 8052 --clock 11.0592MHz --uart -
        mov  TMOD, #0x20        ; timer 1 reloads itself every 3 cycles; 32 overflows are a bit
        mov  TH1, #0xFD
        mov  TL1, #0xFD
        setb TR1
        mov  SCON, #0x40        ; 8 bits, variable rate
        mov  DPTR, #hello
next:   clr  A
        movc A, @A+DPTR
        jz   stop
        inc  DPTR
        mov  SBUF, A
wait:   jnb  TI, wait
        clr  TI
        sjmp next
stop:   sjmp stop
hello:  .ascii "Hello from an 8051"
        .db 10
        .db 0
