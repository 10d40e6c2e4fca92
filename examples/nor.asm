; NOR: as OR, but the complement of the accumulator is stored.
        channels 8, 4

        LD      I1
        OR      I2
        STOC    E1
