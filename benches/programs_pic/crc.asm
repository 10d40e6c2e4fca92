; A shift register fills a block of 64 bytes at 30h through FSR and INDF, and a subroutine computes its CRC-16 (polynomial A001h,
; start 0) bit by bit, in an endless loop. crcL,crcH at 20h: the last complete CRC; rounds at 22h; the shift register
; (Galois, B8h, start 1) at 23h.
        processor 16f873
        include <p16f873.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
crcL    equ 20h
crcH    equ 21h
rounds  equ 22h
lfsr    equ 23h
workL   equ 24h
workH   equ 25h
bits    equ 26h
first   equ 30h
behind  equ 70h

        org 0
        clrf rounds
        movlw 1
        movwf lfsr
round   movlw first
        movwf FSR
pour    bcf STATUS,C
        rrf lfsr,f
        movlw 0B8h
        btfsc STATUS,C
        xorwf lfsr,f
        movf lfsr,w
        movwf INDF
        incf FSR,f
        movf FSR,w
        xorlw behind
        btfss STATUS,Z
        goto pour
        clrf workL
        clrf workH
        movlw first
        movwf FSR
sum     movf INDF,w
        call byte
        incf FSR,f
        movf FSR,w
        xorlw behind
        btfss STATUS,Z
        goto sum
        movf workL,w
        movwf crcL
        movf workH,w
        movwf crcH
        incf rounds,f
        goto round

; Adds the byte in W to the CRC.
byte    xorwf workL,f
        movlw 8
        movwf bits
bit     bcf STATUS,C
        rrf workH,f
        rrf workL,f
        btfss STATUS,C
        goto even
        movlw 0A0h
        xorwf workH,f
        movlw 1
        xorwf workL,f
even    decfsz bits,f
        goto bit
        return
        end
