; NOT, in the three ways that the machine has: by the instruction, by loading the complement, by storing it.
        channels 8, 4

        LD      I1
        NOT
        STO     E1
        LDC     I1
        STO     E2
        LD      I1
        STOC    E3
