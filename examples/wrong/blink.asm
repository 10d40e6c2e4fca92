        list    p=16f873
        include <p16f873.inc>
delay   equ     0x20

        bsf     STATUS, RP0
        bcf     TRISB, 8        ; a byte has the bits 0 to 7
        bcf     STATUS, RP0
loop    movlw   0x100           ; a constant has eight bits
        xorwf   PORTB, f
        decfz   delay, f        ; no such instruction
        goto    lop             ; no such label
        end
