; Capture by CCP1 from its own pin, which the program drives: every edge, the 4th, falling ones.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
#define CYCLES .4000
        include "log.inc"
        cblock 20h
        rise, flag, fall, fourth, fourthflag, early
        endc
up      macro
        bsf PORTC,2
        nop
        endm
down    macro
        bcf PORTC,2
        nop
        endm
        org 0
        clrf PORTC
        bsf STATUS,RP0
        bcf TRISC ^ 80h,2
        bcf STATUS,RP0
        put CCP1CON, b'00000101'
        bcf PIR1,CCP1IF
        put T1CON, 1
        idle .20
        up
        idle .4
        note rise, CCPR1L
        note flag, PIR1
        down
        put CCP1CON, b'00000100'
        up
        bcf PIR1,CCP1IF
        down
        idle .4
        note fall, CCPR1L
        put CCP1CON, b'00000110'
        bcf PIR1,CCP1IF
        up
        down
        up
        down
        up
        down
        idle .4
        note early, PIR1
        up
        idle .4
        note fourth, CCPR1L
        note fourthflag, PIR1
        goto $
        end
