        ldi r24, 0x18
        sts 0x60, r24
        ldi r24, 0x40
        sts 0x60, r24
        ldi r24, 5
        out 0x33, r24
        sei
        sleep
here:   rjmp here
