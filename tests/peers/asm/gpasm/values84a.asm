; chip: pic16f84a
; reports: 202 303
; Values of 32 bits, texts given themselves, and names of the chip before its include.
        list    p=16f84a
        if      ~0 == 0xffffffff
        movlw   1
        endif
        if      0xffffffff <= 0
        movlw   2
        endif
        if      0 < 0x80000000
        movlw   3
        endif
        movlw   .20000000*.1000/.1000000/.100
        movlw   0x80000000>>.28
        movlw   1<<.33
        movlw   1<<-1
        movlw   80>>-1
        movlw   -1>>-1
        movlw   7>>.65
        movlw   -4<<.32
        movlw   -4<<-2
        movlw   11111111B
        movlw   123456789H
        movlw   .99999999999
        movlw   -8 % 3
        dw      0xffffffff
x       set     1
        while   x > 0
        nop
x       set     x<<1
        endw
x       set     7fffffff
x       +=      1
        movlw   x>>.28
x       >>=     .70
        movlw   x
x       <<=     -1
        movlw   x
#define X2(a) ((a)*2)
#define ADD(a,b) ((a)+(b))
        movlw   X2(X2(2))
        movlw   ADD(X2(1),ADD(2,X2(X2(3))))
        ifndef  PORTB
PORTB   equ     7
        endif
#ifndef FSR
#define FSR 0x33
#endif
        movwf   FSR
        movwf   PORTB
        end
