; Timer 1 on the instruction clock: prescalers, stop and go, overflow.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
#define CYCLES .4000
        include "log.inc"
        cblock 20h
        one, two, four, eight, stopped, again, highL, highH, flag, flaglate
        endc
        org 0
        clrf TMR1H
        clrf TMR1L
        put T1CON, b'00000001'
        idle .30
        note one, TMR1L
        clrf T1CON
        clrf TMR1L
        put T1CON, b'00010001'
        idle .30
        note two, TMR1L
        clrf T1CON
        clrf TMR1L
        put T1CON, b'00100001'
        idle .45
        note four, TMR1L
        clrf T1CON
        clrf TMR1L
        put T1CON, b'00110001'
        idle .77
        note eight, TMR1L
        clrf T1CON
        clrf TMR1L
        bsf T1CON,TMR1ON
        idle .10
        bcf T1CON,TMR1ON
        note stopped, TMR1L
        bsf T1CON,TMR1ON
        idle .10
        bcf T1CON,TMR1ON
        note again, TMR1L
        put TMR1H, 0FEh
        put TMR1L, 0F0h
        bcf PIR1,TMR1IF
        bsf T1CON,TMR1ON
        idle .100
        bcf T1CON,TMR1ON
        note highL, TMR1L
        note highH, TMR1H
        put TMR1H, 0FFh
        put TMR1L, 0F0h
        bsf T1CON,TMR1ON
        idle .14
        note flag, PIR1
        note flaglate, PIR1
        goto $
        end
