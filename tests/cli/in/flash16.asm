; Reads a word of its own program: the chip ignores the two words behind the read.
        list    p=16f877a
        include <p16f877a.inc>
        __config 0x3F72
        banksel EEADR
        movlw   5
        movwf   EEADR
        clrf    EEADRH
        banksel EECON1
        bsf     EECON1, EEPGD
        bsf     EECON1, RD
        nop
        nop
        banksel EEDATA
        movf    EEDATH, w
        movf    EEDATA, w
        goto    $
        end
