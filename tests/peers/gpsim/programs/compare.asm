; Compare by CCP1: set, clear, flag alone, and the special event, whose period is timed.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
#define CYCLES .6000
        include "log.inc"
        cblock 20h
        before, risen, flag, cleared, soft, softpin, special, specialL, specialT
        endc
        org 0
        clrf PORTC
        bsf STATUS,RP0
        bcf TRISC ^ 80h,2
        bcf STATUS,RP0
        clrf CCPR1H
        put CCPR1L, .40
        put CCP1CON, b'00001000'
        clrf TMR1H
        clrf TMR1L
        bcf PIR1,CCP1IF
        put T1CON, 1
        idle .20
        note before, PORTC
        idle .30
        note risen, PORTC
        note flag, PIR1
        clrf T1CON
        clrf TMR1L
        put CCP1CON, b'00001001'
        bcf PIR1,CCP1IF
        put T1CON, 1
        idle .60
        note cleared, PORTC
        clrf T1CON
        clrf TMR1L
        put CCP1CON, b'00001010'
        bcf PIR1,CCP1IF
        put T1CON, 1
        idle .60
        note soft, PIR1
        note softpin, PORTC
        clrf T1CON
        clrf TMR1L
        put CCP1CON, b'00001011'
        bcf PIR1,CCP1IF
        put T1CON, 1
        idle .60
        note special, PIR1
        note specialL, TMR1L
        ; Ten periods further it shows how long one is.
        idle .205
        idle .205
        note specialT, TMR1L
        goto $
        end
