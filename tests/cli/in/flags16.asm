; Three interrupts at one vector: of timer 0, of the pin INT, and of both.
        list p=16f877a
        include <p16f877a.inc>
        org 0
        goto main
        org 4
        bcf INTCON,T0IF
        bcf INTCON,INTF
        retfie
main    movlw b'00110000'
        movwf INTCON
        bsf INTCON,T0IF
        bsf INTCON,GIE
        nop
        bsf INTCON,INTF
        nop
        bcf INTCON,GIE
        bsf INTCON,INTF
        bsf INTCON,T0IF
        bsf INTCON,GIE
        nop
        goto $
        end
