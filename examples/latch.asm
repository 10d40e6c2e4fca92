; A motor with two push buttons: I1 starts it, I2 stops it, and stop wins.
;
; The machine cannot read an output channel. What `OR E1` reads is the image that memory keeps of it, written together with
; the output by the STO of the cycle before: that is the feedback that holds the motor on.
        channels 8, 4
start   equ     I1
stop    equ     I2
motor   equ     E1

        LD      start
        OR      motor
        ANDC    stop
        STO     motor

; The same with the conditional instructions, for a second motor: they write only while the accumulator is 1.
        LD      start
        STC     E2
        LD      stop
        RTC     E2
