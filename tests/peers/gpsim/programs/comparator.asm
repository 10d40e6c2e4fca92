; Comparators and their reference: modes as read back, the reference, outputs inverted with everything off.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
#define CYCLES .2000
        include "log.inc"
        cblock 20h
        power, off, inverted, reference, refon, flags
        endc
        org 0
        note1 power, CMCON
        put1 CMCON, 7
        idle .20
        note1 off, CMCON
        put1 CMCON, 37h
        idle .20
        note1 inverted, CMCON
        put1 CVRCON, 0ACh
        idle .60
        note1 reference, CVRCON
        put1 CMCON, 2
        idle .60
        note1 refon, CVRCON
        note flags, PIR2
        goto $
        end
