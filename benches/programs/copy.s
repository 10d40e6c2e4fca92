; Copies 256 bytes from data 0x0100 to data 0x0300, in an endless loop.
; start
        ldi  r26, 0x00          ; X = 0x0100
        ldi  r27, 0x01
        ldi  r28, 0x00          ; Y = 0x0300
        ldi  r29, 0x03
        ldi  r24, 0             ; 256 bytes
; loop
        ld   r0, X+
        st   Y+, r0
        dec  r24
        brne .-8                ; to loop
        inc  r20                ; rounds
        rjmp .-22               ; to start
