; chip: atmega8
; Negative constants down to -255.
        .equ low, -255
        ldi r16, -129
        ldi r17, -200
        ldi r18, low
        ldi r19, -(1<<7)-1
        subi r20, -130
        sbci r21, -256+1
        andi r22, -129
        ori r23, -250
        cpi r24, ahead
        sbr r25, -255
        .equ ahead, -131
        ldi r16, ~0x80
        ldi r16, (0-129)
