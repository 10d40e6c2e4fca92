; Two programs in turn, one cycle each. They are the same words: each has an index of its own, and what bears ,X is that much
; further on. The first makes E1 of I1 and I2, the second E5 of I5 and I6. A third, with code of its own, blinks E0.
        channels 16, 8
        program gate, gate_end - 1, 0
        program gate, gate_end - 1, 4
        program blink, blink_end - 1

gate:   LD      I1,X
        AND     I2,X
        STO     E1,X
gate_end:

blink:  LDC     E0
        STO     E0
blink_end:
