; Timer 0 overflows every 16 cycles, and its service routine counts in RAM and changes a bit.
        org   0
        sjmp  start
        org   0x0b
overflow:
        inc   0x30
        cpl   0x20.3
        reti
start:  mov   tmod, #2
        mov   th0, #0xf0
        mov   tl0, #0xf0
        mov   r0, #0x31
        mov   @r0, #5
        setb  tr0
        mov   ie, #0x82
here:   sjmp  here
