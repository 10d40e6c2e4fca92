; Timer 0: prescalers, what a write does to them, and its flag.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
#define CYCLES .6000
        include "log.inc"
        cblock 20h
        pre2, pre2late, pre4, pre8, pre16, pre256, cleared, flagat, wdtpre
        endc
        org 0
        put1 OPTION_REG, b'11010000'
        clrf TMR0
        idle .20
        note pre2, TMR0
        idle .100
        note pre2late, TMR0
        put1 OPTION_REG, b'11010001'
        clrf TMR0
        idle .41
        note pre4, TMR0
        put1 OPTION_REG, b'11010010'
        clrf TMR0
        idle .44
        note pre8, TMR0
        put1 OPTION_REG, b'11010011'
        clrf TMR0
        idle .88
        note pre16, TMR0
        put1 OPTION_REG, b'11010111'
        clrf TMR0
        idle .200
        idle .200
        note pre256, TMR0
        ; A write in the middle of a period of the prescaler clears it.
        put1 OPTION_REG, b'11010101'
        clrf TMR0
        idle .60
        clrf TMR0
        idle .40
        note cleared, TMR0
        ; How many turns of five cycles until the flag is set.
        put1 OPTION_REG, b'11010000'
        clrf flagat
        put TMR0, 80h
        bcf INTCON,T0IF
wait    incf flagat,f
        btfss INTCON,T0IF
        goto wait
        put1 OPTION_REG, b'11011111'
        clrf TMR0
        idle .30
        note wdtpre, TMR0
        goto $
        end
