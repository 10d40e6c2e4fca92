; EEPROM: a write, when its flag comes, what is read back, and a write while one is on.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
#define CYCLES .50000
        include "log.inc"
        cblock 70h
        before, con, flag, flaglate, conlate, back, other, turns, turns1
        endc
write   macro addr, value
        bsf STATUS,RP1
        bcf STATUS,RP0
        movlw addr
        movwf EEADR ^ 100h
        movlw value
        movwf EEDATA ^ 100h
        bsf STATUS,RP0
        bcf EECON1 ^ 180h,EEPGD
        bsf EECON1 ^ 180h,WREN
        movlw 55h
        movwf EECON2 ^ 180h
        movlw 0AAh
        movwf EECON2 ^ 180h
        bsf EECON1 ^ 180h,WR
        bcf EECON1 ^ 180h,WREN
        endm
read    macro addr, cell
        bsf STATUS,RP1
        bcf STATUS,RP0
        movlw addr
        movwf EEADR ^ 100h
        bsf STATUS,RP0
        bcf EECON1 ^ 180h,EEPGD
        bsf EECON1 ^ 180h,RD
        bcf STATUS,RP0
        movf EEDATA ^ 100h,w
        movwf cell
        bcf STATUS,RP1
        endm
        org 0
        read 5, before
        write 5, 42h
        movf EECON1 ^ 180h,w
        movwf con
        bcf STATUS,RP0
        bcf STATUS,RP1
        idle .100
        note flag, PIR2
        far turns, .21
        note flaglate, PIR2
        bsf STATUS,RP0
        bsf STATUS,RP1
        movf EECON1 ^ 180h,w
        movwf conlate
        bcf STATUS,RP0
        bcf STATUS,RP1
        read 5, back
        read 6, other
        goto $
        end
