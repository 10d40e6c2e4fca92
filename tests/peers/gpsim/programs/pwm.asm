; PWM on RC2, sampled every cycle over four periods; ten bits of duty, and a duty longer than the period.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
#define CYCLES .9000
        include "log.inc"
        cblock 20h
        high10, high20, changed, always, never
        endc
; Counts, over 80 samples two cycles apart, how often RC2 is high.
sample  macro cell
        local i
        clrf cell
i       = 0
        while i < .80
        btfsc PORTC,2
        incf cell,f
i       += 1
        endw
        endm
        org 0
        bsf STATUS,RP0
        movlw .39
        movwf PR2 ^ 80h
        bcf TRISC ^ 80h,2
        bcf STATUS,RP0
        put CCPR1L, .10
        put CCP1CON, b'00001100'
        put T2CON, b'00000100'
        idle .100
        sample high10
        put CCPR1L, .20
        idle .100
        sample high20
        put CCPR1L, .30
        sample changed
        put CCPR1L, .60
        idle .100
        sample always
        clrf CCPR1L
        idle .100
        sample never
        goto $
        end
