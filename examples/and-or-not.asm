; AND-OR-NOT of six inputs: E1 = not (I1 I2 + I3 I4 + I5 I6). The sum grows in a bit of memory, one product at a time.
        channels 8, 4
sum     equ     M1

        LD      I1
        AND     I2
        STO     sum
        LD      I3
        AND     I4
        OR      sum
        STO     sum
        LD      I5
        AND     I6
        OR      sum
        STOC    E1
