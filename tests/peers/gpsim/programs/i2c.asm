; I2C as master with nobody there: start, a byte that is not acknowledged, repeated start, stop.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
#define CYCLES .6000
;; pullup RC3
;; pullup RC4
        include "log.inc"
        cblock 20h
        started, startstat, acked, bufflag, restarted, stopped, stopstat, pir
        endc
        org 0
        put1 SSPADD, .9
        put1 SSPSTAT, 80h
        put SSPCON, b'00101000'
        bcf PIR1,SSPIF
        put1 SSPCON2, 1
        idle .60
        note1 started, SSPCON2
        note1 startstat, SSPSTAT
        bcf PIR1,SSPIF
        put SSPBUF, 0A0h
        idle .150
        note1 acked, SSPCON2
        note1 bufflag, SSPSTAT
        bcf PIR1,SSPIF
        put1 SSPCON2, 2
        idle .80
        note1 restarted, SSPCON2
        put1 SSPCON2, 4
        idle .80
        note1 stopped, SSPCON2
        note1 stopstat, SSPSTAT
        note pir, PIR1
        goto $
        end
