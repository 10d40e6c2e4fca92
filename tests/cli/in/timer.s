; Timer 0 overflows every 256 cycles, and its service routine counts in RAM; the second time it runs into erased memory.
    rjmp start
.org 0x40
overflow:
    lds  r16, 0x0100
    inc  r16
    sts  0x0100, r16
    sbrc r16, 1
    rjmp 0x200
    reti
start:
    ldi  r16, 1
    out  0x25, r16
    sts  0x006E, r16
    sei
wait:
    rjmp wait
