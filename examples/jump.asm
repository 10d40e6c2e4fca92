; Conditional jump: while I0 asks for it by hand, E1 follows the button I1; otherwise it follows the sensor I2 or I3.
        channels 8, 4

first:  LD      I0
        JMPC    manual
        LD      I2
        OR      I3
        STO     E1
        JMP     first           ; back to the start: this program cycle is over
manual: LD      I1
        STO     E1              ; the last word: so it is here
