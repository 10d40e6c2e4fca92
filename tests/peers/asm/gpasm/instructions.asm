; chip: pic16f873
; Every form of every instruction, with operands at the edges of what they may hold.
        list    p=16f873
        include <p16f873.inc>
        errorlevel -302, -224, -305
first   nop
; Byte-oriented: both destinations in all spellings, every bank.
        addwf   0, W
        addwf   0x7F, F
        addwf   0x20, w
        addwf   0x20, f
        addwf   0x20, 0
        addwf   0x20, 1
        addwf   STATUS
        addwf   0x81, W
        addwf   0x1FF, F
        addwf   PORTB, W
        addwf   INDF, F
        andwf   0, W
        andwf   0x7F, F
        andwf   0x20, w
        andwf   0x20, f
        andwf   0x20, 0
        andwf   0x20, 1
        andwf   STATUS
        andwf   0x81, W
        andwf   0x1FF, F
        andwf   PORTB, W
        andwf   INDF, F
        comf    0, W
        comf    0x7F, F
        comf    0x20, w
        comf    0x20, f
        comf    0x20, 0
        comf    0x20, 1
        comf    STATUS
        comf    0x81, W
        comf    0x1FF, F
        comf    PORTB, W
        comf    INDF, F
        decf    0, W
        decf    0x7F, F
        decf    0x20, w
        decf    0x20, f
        decf    0x20, 0
        decf    0x20, 1
        decf    STATUS
        decf    0x81, W
        decf    0x1FF, F
        decf    PORTB, W
        decf    INDF, F
        decfsz  0, W
        decfsz  0x7F, F
        decfsz  0x20, w
        decfsz  0x20, f
        decfsz  0x20, 0
        decfsz  0x20, 1
        decfsz  STATUS
        decfsz  0x81, W
        decfsz  0x1FF, F
        decfsz  PORTB, W
        decfsz  INDF, F
        incf    0, W
        incf    0x7F, F
        incf    0x20, w
        incf    0x20, f
        incf    0x20, 0
        incf    0x20, 1
        incf    STATUS
        incf    0x81, W
        incf    0x1FF, F
        incf    PORTB, W
        incf    INDF, F
        incfsz  0, W
        incfsz  0x7F, F
        incfsz  0x20, w
        incfsz  0x20, f
        incfsz  0x20, 0
        incfsz  0x20, 1
        incfsz  STATUS
        incfsz  0x81, W
        incfsz  0x1FF, F
        incfsz  PORTB, W
        incfsz  INDF, F
        iorwf   0, W
        iorwf   0x7F, F
        iorwf   0x20, w
        iorwf   0x20, f
        iorwf   0x20, 0
        iorwf   0x20, 1
        iorwf   STATUS
        iorwf   0x81, W
        iorwf   0x1FF, F
        iorwf   PORTB, W
        iorwf   INDF, F
        movf    0, W
        movf    0x7F, F
        movf    0x20, w
        movf    0x20, f
        movf    0x20, 0
        movf    0x20, 1
        movf    STATUS
        movf    0x81, W
        movf    0x1FF, F
        movf    PORTB, W
        movf    INDF, F
        rlf     0, W
        rlf     0x7F, F
        rlf     0x20, w
        rlf     0x20, f
        rlf     0x20, 0
        rlf     0x20, 1
        rlf     STATUS
        rlf     0x81, W
        rlf     0x1FF, F
        rlf     PORTB, W
        rlf     INDF, F
        rrf     0, W
        rrf     0x7F, F
        rrf     0x20, w
        rrf     0x20, f
        rrf     0x20, 0
        rrf     0x20, 1
        rrf     STATUS
        rrf     0x81, W
        rrf     0x1FF, F
        rrf     PORTB, W
        rrf     INDF, F
        subwf   0, W
        subwf   0x7F, F
        subwf   0x20, w
        subwf   0x20, f
        subwf   0x20, 0
        subwf   0x20, 1
        subwf   STATUS
        subwf   0x81, W
        subwf   0x1FF, F
        subwf   PORTB, W
        subwf   INDF, F
        swapf   0, W
        swapf   0x7F, F
        swapf   0x20, w
        swapf   0x20, f
        swapf   0x20, 0
        swapf   0x20, 1
        swapf   STATUS
        swapf   0x81, W
        swapf   0x1FF, F
        swapf   PORTB, W
        swapf   INDF, F
        xorwf   0, W
        xorwf   0x7F, F
        xorwf   0x20, w
        xorwf   0x20, f
        xorwf   0x20, 0
        xorwf   0x20, 1
        xorwf   STATUS
        xorwf   0x81, W
        xorwf   0x1FF, F
        xorwf   PORTB, W
        xorwf   INDF, F
        clrf    0
        clrf    0x7F
        clrf    TRISA
        clrf    0x1FF
        clrf    FSR
        movwf   0
        movwf   0x7F
        movwf   TRISA
        movwf   0x1FF
        movwf   FSR
        clrw
        nop
; Bit-oriented.
        bcf     0x20, 0
        bcf     0x21, 1
        bcf     0x22, 2
        bcf     0x23, 3
        bcf     0x24, 4
        bcf     0x25, 5
        bcf     0x26, 6
        bcf     0x27, 7
        bcf     0, 0
        bcf     0x7F, 7
        bcf     STATUS, RP0
        bcf     TRISB, TRISB7
        bcf     PORTA, RA4
        bcf     INTCON, GIE
        bsf     0x20, 0
        bsf     0x21, 1
        bsf     0x22, 2
        bsf     0x23, 3
        bsf     0x24, 4
        bsf     0x25, 5
        bsf     0x26, 6
        bsf     0x27, 7
        bsf     0, 0
        bsf     0x7F, 7
        bsf     STATUS, RP0
        bsf     TRISB, TRISB7
        bsf     PORTA, RA4
        bsf     INTCON, GIE
        btfsc   0x20, 0
        btfsc   0x21, 1
        btfsc   0x22, 2
        btfsc   0x23, 3
        btfsc   0x24, 4
        btfsc   0x25, 5
        btfsc   0x26, 6
        btfsc   0x27, 7
        btfsc   0, 0
        btfsc   0x7F, 7
        btfsc   STATUS, RP0
        btfsc   TRISB, TRISB7
        btfsc   PORTA, RA4
        btfsc   INTCON, GIE
        btfss   0x20, 0
        btfss   0x21, 1
        btfss   0x22, 2
        btfss   0x23, 3
        btfss   0x24, 4
        btfss   0x25, 5
        btfss   0x26, 6
        btfss   0x27, 7
        btfss   0, 0
        btfss   0x7F, 7
        btfss   STATUS, RP0
        btfss   TRISB, TRISB7
        btfss   PORTA, RA4
        btfss   INTCON, GIE
; Constants.
        addlw   0
        addlw   1
        addlw   0x7F
        addlw   0x80
        addlw   0xFF
        addlw   -1
        addlw   -.128
        addlw   'A'
        andlw   0
        andlw   1
        andlw   0x7F
        andlw   0x80
        andlw   0xFF
        andlw   -1
        andlw   -.128
        andlw   'A'
        iorlw   0
        iorlw   1
        iorlw   0x7F
        iorlw   0x80
        iorlw   0xFF
        iorlw   -1
        iorlw   -.128
        iorlw   'A'
        movlw   0
        movlw   1
        movlw   0x7F
        movlw   0x80
        movlw   0xFF
        movlw   -1
        movlw   -.128
        movlw   'A'
        retlw   0
        retlw   1
        retlw   0x7F
        retlw   0x80
        retlw   0xFF
        retlw   -1
        retlw   -.128
        retlw   'A'
        sublw   0
        sublw   1
        sublw   0x7F
        sublw   0x80
        sublw   0xFF
        sublw   -1
        sublw   -.128
        sublw   'A'
        xorlw   0
        xorlw   1
        xorlw   0x7F
        xorlw   0x80
        xorlw   0xFF
        xorlw   -1
        xorlw   -.128
        xorlw   'A'
; Jumps within and across pages.
        call    0
        call    1
        call    0x7FF
        call    0x800
        call    0xFFF
        call    first
        call    last
        call    $
        call    $-1
        call    $+1
        goto    0
        goto    1
        goto    0x7FF
        goto    0x800
        goto    0xFFF
        goto    first
        goto    last
        goto    $
        goto    $-1
        goto    $+1
; The rest.
        clrwdt
        retfie
        return
        sleep
        option
        tris    5
        tris    6
        tris    7
        tris    PORTA
        tris    TRISB
; Case of letters, and spaces.
        MOVLW 1
        Movlw 2
        ADDWF 0x20,W
        addwf 0x20 , F
        bsf STATUS,RP0
        btfss  STATUS ,Z
        goto $ + 2
        CLRW
        NOP
        org     0x0FFE
last    goto    first
        call    last
        end
