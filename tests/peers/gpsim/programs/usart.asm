; The USART, sending to itself: flags on the way, two bytes, nine bits, an overrun.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
#define CYCLES .9000
;; wire RC6 RC7
        include "log.inc"
        cblock 20h
        idleflags, idleta, loaded, second, sending, sent, got1, got2, ninth, got3, over, overflow, cleared
        endc
        org 0
        bsf STATUS,RP0
        bcf TRISC ^ 80h,6
        bcf STATUS,RP0
        put1 SPBRG, 1
        put1 TXSTA, b'00100100'
        put RCSTA, b'10010000'
        idle .20
        note idleflags, PIR1
        note1 idleta, TXSTA
        put TXREG, 0A5h
        nop
        nop
        note loaded, PIR1
        put TXREG, 3Ch
        nop
        note second, PIR1
        note1 sending, TXSTA
        idle .220
        note1 sent, TXSTA
        note got1, RCREG
        note got2, RCREG
        put1 TXSTA, b'01100101'
        put RCSTA, b'11010000'
        put TXREG, 0C3h
        idle .120
        note ninth, RCSTA
        note got3, RCREG
        ; Three bytes that nobody reads.
        put TXREG, 1
        idle .100
        put TXREG, 2
        idle .100
        put TXREG, 3
        idle .120
        note over, RCSTA
        bcf RCSTA,CREN
        note overflow, RCSTA
        bsf RCSTA,CREN
        note cleared, RCSTA
        goto $
        end
