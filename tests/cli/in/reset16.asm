    bsf 3,5
    clrf 6
    bcf 3,5
    movlw 0x55
    movwf 6
here:   goto here
