; A timer that software sets: a lamp follows its switch after 200 ms, or after 50 ms while I2 asks for the quick way.
        channels 8, 4
        module  R1, TON, 10ms, 20

        LD      I2
        JMPC    quick
        TIM     R1, #20         ; two words: a store to the port of R1, and a NOP that carries 20
        JMP     run
quick:  TIM     R1, #5
run:    LD      I1
        STO     R1              ; the timer's input
        LD      T1              ; its contact: T1 is another name of R1, for reading
        STO     E1
