; chip: pic16f84a
; reports: 302
; A program as people write them: a light that runs to and fro, its speed kept in the EEPROM; the plain words of the manual.
        list    p=16f84a
        radix   hex
        include <p16f84a.inc>
        __config _XT_OSC & _WDT_OFF & _PWRTE_ON & _CP_OFF
speed   equ     0c
inner   equ     0d
outer   equ     0e
left    equ     0f
        org     0
        bsf     STATUS, RP0
        clrf    TRISB
        bcf     STATUS, RP0
        movlw   0
        movwf   EEADR
        bsf     STATUS, RP0
        bsf     EECON1, RD
        bcf     STATUS, RP0
        movf    EEDATA, w
        movwf   speed
        movlw   1
        movwf   PORTB
        clrf    left
again   call    delay
        btfsc   left, 0
        goto    down
        bcf     STATUS, C
        rlf     PORTB, f
        btfsc   PORTB, 7
        bsf     left, 0
        goto    again
down    bcf     STATUS, C
        rrf     PORTB, f
        btfsc   PORTB, 0
        bcf     left, 0
        goto    again
delay   movf    speed, w
        movwf   outer
delay1  movlw   0ff
        movwf   inner
delay2  decfsz  inner, f
        goto    delay2
        decfsz  outer, f
        goto    delay1
        return
table   addwf   PCL, f
        dt      3f, 6, 5b, 4f, 66, 6d, 7d, 7, 7f, 6f
        org     2100
        de      20
        end
