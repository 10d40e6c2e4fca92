; Sleep: the watchdog wakes it, TO and PD say so; INT wakes it with GIE clear and set; a clear of TO and PD.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_ON & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _RC_OSC
#define CYCLES .400000
        include "log.inc"
        cblock 20h
        atstart, woken, cleared, again, dogreset, mark
        endc
        org 0
        ; A reset by the watchdog finds the mark.
        movf mark,w
        xorlw 5Ah
        btfsc STATUS,Z
        goto bitten
        note atstart, STATUS
        put1 OPTION_REG, b'11011000'
        clrwdt
        sleep
        note woken, STATUS
        clrwdt
        note cleared, STATUS
        put1 OPTION_REG, b'11011001'
        clrwdt
        sleep
        note again, STATUS
        put mark, 5Ah
        goto $
bitten  clrf mark
        note dogreset, STATUS
        clrwdt
here    clrwdt
        goto here
        end
