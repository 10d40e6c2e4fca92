; Sleeps until timer 1 on its crystal of 32768 Hz has counted 256 (7.8 ms); 20h,21h count the wake-ups.
        processor 16f873
        include <p16f873.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
wakesL  equ 20h
wakesH  equ 21h

        org 0
        clrf wakesL
        clrf wakesH
        bsf STATUS,RP0
        bsf PIE1,TMR1IE
        bcf STATUS,RP0
        bsf INTCON,PEIE         ; GIE stays 0: it goes on in line.
        movlw 0FFh
        movwf TMR1H
        clrf TMR1L
        movlw 1<<T1OSCEN | 1<<T1SYNC | 1<<TMR1CS | 1<<TMR1ON
        movwf T1CON
doze    sleep
        nop
        movlw 0FFh
        movwf TMR1H
        bcf PIR1,TMR1IF
        incf wakesL,f
        btfsc STATUS,Z
        incf wakesH,f
        goto doze
        end
