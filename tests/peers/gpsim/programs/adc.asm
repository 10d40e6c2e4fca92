; The converter at Fosc/2, Fosc/8 and Fosc/32: when GO is cleared, and its flag.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
#define CYCLES .4000
        include "log.inc"
        cblock 20h
        quick, quickend, eight, eightend, slow, slowend, flag, off
        endc
go      macro first, later, cell, last
        put ADCON0, first
        idle .60
        bcf PIR1,ADIF
        bsf ADCON0,GO
        idle later
        note cell, ADCON0
        idle .8
        note last, ADCON0
        endm
        org 0
        go 01h, .2, quick, quickend
        go 41h, .18, eight, eightend
        go 81h, .90, slow, slowend
        note flag, PIR1
        clrf ADCON0
        bsf ADCON0,GO
        idle .40
        note off, ADCON0
        goto $
        end
