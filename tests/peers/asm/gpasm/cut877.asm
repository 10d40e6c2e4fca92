; chip: pic16f877
; reports: 202 211 219 302 303 305 224
; Operands beyond their fields, and numbers with signs.
        list    p=16f877, r=dec
        org     0
        movlw   -d'195'
        movlw   -.195
        movlw   -h'3c'
        movlw   -b'1010'
        movlw   -o'17'
        movlw   ~d'15'
        movlw   !5
        movlw   +d'9'
        movlw   256
        movlw   -1
        movlw   -128
        movlw   -129
        movlw   -255
        movlw   -256
        movlw   -257
        movlw   0x2100
        movlw   0xffffffff
        addlw   300
        sublw   511
        andlw   -300
        iorlw   1000
        xorlw   65535
        retlw   0x1ff
        retlw   b'000111111'
        movf    0x200, w
        movf    0x1ff, w
        movf    -1, f
        movwf   0x12345
        clrf    512
        bsf     5, 8
        bcf     5, -1
        btfsc   300, 9
        btfss   3, 15
        movf    3, 2
        movf    3, 3
        rlf     5, 5
        incf    5
        goto    0x2001
        goto    -1
        call    0x3fff
        nop     1
        clrw    0
        tris    0x106
        dw      0xffff, -1, 0x4001
        data    -5
        fill    0x8001, 2
        db      -1, 2
        dt      -1
        ifdef   __16F877
        movlw   __CODE_END & 0xff
        movlw   high(__EEPROM_END)
        movlw   __COMMON_RAM_START
        movlw   __COMMON_RAM_END
        movlw   __VECTOR_INT
        endif
        ifdef   __16F877A
        sleep
        endif
room    res     3
        goto    room
        end
