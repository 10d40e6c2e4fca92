; Two mistakes.
        LD      I1
        ADN     I2
        STO     I600
