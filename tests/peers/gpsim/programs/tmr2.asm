; Timer 2: period, prescaler, postscaler.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
#define CYCLES .8000
        include "log.inc"
        cblock 20h
        free, period, pre4, pre16, post1, post3
        endc
        org 0
        put1 PR2, .99
        clrf TMR2
        put T2CON, b'00000100'
        idle .50
        note free, TMR2
        idle .70
        note period, TMR2
        clrf T2CON
        clrf TMR2
        put T2CON, b'00000101'
        idle .90
        note pre4, TMR2
        clrf T2CON
        clrf TMR2
        put T2CON, b'00000110'
        idle .90
        note pre16, TMR2
        ; Turns of three cycles until the flag, at 1:1 and at 1:3.
        clrf T2CON
        clrf TMR2
        bcf PIR1,TMR2IF
        clrf post1
        put T2CON, b'00000100'
wait1   incf post1,f
        btfss PIR1,TMR2IF
        goto wait1
        clrf T2CON
        clrf TMR2
        bcf PIR1,TMR2IF
        clrf post3
        put T2CON, b'00010100'
wait3   incf post3,f
        btfss PIR1,TMR2IF
        goto wait3
        goto $
        end
