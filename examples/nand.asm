; NAND: as AND, but the complement of the accumulator is stored.
        channels 8, 4

        LD      I1
        AND     I2
        STOC    E1
