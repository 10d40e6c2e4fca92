; CRC-16 (polynomial 0x1021, start 0xFFFF, most significant bit first) of the 256 bytes at data 0x0100, bit by bit. The
; result of each round goes to data 0x0500 and 0x0501, low byte first.
        ldi  r18, 0x21          ; polynomial
        ldi  r19, 0x10
; start
        ldi  r24, 0xFF          ; r25:24: the remainder
        ldi  r25, 0xFF
        ldi  r26, 0x00          ; X = 0x0100
        ldi  r27, 0x01
        ldi  r20, 0             ; 256 bytes
; byte
        ld   r0, X+
        eor  r25, r0
        ldi  r21, 8
; bit
        lsl  r24
        rol  r25
        brcc .+4                ; over the two that follow
        eor  r24, r18
        eor  r25, r19
        dec  r21
        brne .-14               ; to bit
        dec  r20
        brne .-24               ; to byte
        sts  0x0500, r24
        sts  0x0501, r25
        rjmp .-44               ; to start
