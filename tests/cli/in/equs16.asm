; Assembled by gpasm: the names of registers, as a header has them, are constants in equs16.cod.
        list p=16f877
STATUS  equ 3
PORTB   equ 6
TMR0    equ 1
limit   equ 5
count   equ 0x20
        org 0
start   movlw limit
        movwf count
        bsf STATUS, 5
        movwf PORTB
        bcf STATUS, 5
        goto $
        end
