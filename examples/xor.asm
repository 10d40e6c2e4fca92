; XOR: a landing light between two switches; either of them changes it.
        channels 8, 4

        LD      I1
        XOR     I2
        STO     E1
