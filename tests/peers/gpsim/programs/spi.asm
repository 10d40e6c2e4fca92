; SPI as master, SDO to SDI: both clocks, both phases of the sample, the flag, a write too early.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
#define CYCLES .4000
;; wire RC5 RC4
        include "log.inc"
        cblock 20h
        early, full, got, got16, flag16, other, collision, stat
        endc
        org 0
        bsf STATUS,RP0
        movlw b'11010111'
        movwf TRISC ^ 80h
        movlw b'01000000'
        movwf SSPSTAT ^ 80h
        bcf STATUS,RP0
        put SSPCON, b'00100001'
        bcf PIR1,SSPIF
        put SSPBUF, 5Ah
        note early, PIR1
        idle .40
        note1 full, SSPSTAT
        note got, SSPBUF
        clrf SSPCON
        put SSPCON, b'00100001'
        bcf PIR1,SSPIF
        put SSPBUF, 0C3h
        idle .20
        note flag16, PIR1
        idle .20
        note got16, SSPBUF
        clrf SSPCON
        put1 SSPSTAT, 0
        put SSPCON, b'00110001'
        bcf PIR1,SSPIF
        put SSPBUF, 96h
        put SSPBUF, 11h
        idle .50
        note other, SSPBUF
        note collision, SSPCON
        note1 stat, SSPSTAT
        goto $
        end
