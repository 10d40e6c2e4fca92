; Says hello over the USART, 9615 baud at 4 MHz, and sleeps.
;
;   emu run examples/pic16/hello.hex --mcu pic16f877a --uart -
        list    p=16f877a, r=dec
        #include <p16f877a.inc>
        __CONFIG _XT_OSC & _WDT_OFF & _PWRTE_ON & _BODEN_OFF & _LVP_OFF

next    equ     0x20

        org     0
        bsf     STATUS, RP0
        movlw   25              ; 4 MHz / 16 / 26
        movwf   SPBRG ^ 0x80
        movlw   (1 << TXEN) | (1 << BRGH)
        movwf   TXSTA ^ 0x80
        bcf     STATUS, RP0
        movlw   1 << SPEN
        movwf   RCSTA
        clrf    next
send    movf    next, W
        call    text
        iorlw   0
        btfsc   STATUS, Z
        goto    done
        btfss   PIR1, TXIF
        goto    $ - 1
        movwf   TXREG
        incf    next, F
        goto    send
done    bsf     STATUS, RP0
        btfss   TXSTA ^ 0x80, TRMT
        goto    $ - 1
        sleep
        goto    $ - 1
text    addwf   PCL, F
        dt      "Hello from a PIC16\n", 0
        end
