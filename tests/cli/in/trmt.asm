; A byte at 19,200 bit/s; RB0 rises, and the program ends, where it sees TRMT.
        list    p=16f877a
        include <p16f877a.inc>
        __config 0x3F72
        banksel TRISB
        clrf    TRISB
        movlw   .12
        movwf   SPBRG
        movlw   0x24
        movwf   TXSTA
        banksel PORTB
        clrf    PORTB
        bsf     RCSTA, SPEN
        movlw   0xFF
        movwf   TXREG
        nop
        banksel TXSTA
wait:   btfss   TXSTA, TRMT
        goto    wait
        banksel PORTB
        bsf     PORTB, 0
        goto    $
        end
