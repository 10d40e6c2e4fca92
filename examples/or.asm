; OR: the output is on while at least one of the inputs is.
        channels 8, 4

        LD      I1
        OR      I2
        STO     E1
