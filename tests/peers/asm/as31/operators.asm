; chip: 8051
; The order of operators and of the sign in front of a value.
        .org 0
        mov a, #-5+10
        mov a, #-2*3+1
        mov a, #-(2)-3
        mov a, #-6/2-1
        mov a, #10-3-2
        mov a, #-1+2*3
        mov a, #2*3+4
        mov a, #2+3*4
        mov a, #1|2&4
        mov a, #1<<2+1
        mov a, #10/3*3
        mov a, #10%4+1
        mov a, #-3%2
        mov a, #3--1
        mov a, #(-5)+10
        mov a, #- 5 - 10 
        mov a, #-5*2
        mov a, #-5-3-2
        mov a, #-5&3
        mov a, #-5|3
        mov a, #-1<<2
        .dw -5+10, -3*-3, -7/2, -7%4
        .dw --5, -1|2
