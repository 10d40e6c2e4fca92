; Sleeps until the watchdog (1:1, 18 ms) wakes it; 20h,21h count the wake-ups.
        processor 16f873
        include <p16f873.inc>
        __config _WDT_ON & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
wakesL  equ 20h
wakesH  equ 21h

        org 0
        clrf wakesL
        clrf wakesH
        bsf STATUS,RP0
        movlw b'11010000'       ; The prescaler belongs to timer 0.
        movwf OPTION_REG
        bcf STATUS,RP0
doze    clrwdt
        sleep
        incf wakesL,f
        btfsc STATUS,Z
        incf wakesH,f
        goto doze
        end
