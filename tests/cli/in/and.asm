; AND: the output is on while both inputs are.
        channels 8, 4           ; inputs I0 to I7, outputs E0 to E3

        LD      I1
        AND     I2
        STO     E1
