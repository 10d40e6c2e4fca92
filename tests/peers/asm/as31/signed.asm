; chip: 8051
; A sign binds less than shifts, & and |, and more than * / %.  Lines after .end are read.
        .org 0
        .equ one, 1
        .dw -1&3, -5|3, -5>>1, -5&3*2, -1<<2
        .dw (2/-1/2) & 0xffff, (9/-12/100) & 0xffff, (7/-2*2) & 0xffff, (7%-4/2) & 0xffff
        .dw -2+5*3, (100/-7%5) & 0xffff, 3*-2*-1, --5&3, 10-5&3, 1--5&3
        .dw (-1 & 3) * one, -one*-one, (-(5)&3) & 0xffff
        mov a, #-1 & 3
        mov r0, #-128/-3/2
start:  sjmp start
        .end
        mov a, #2
late:   .END
        ljmp late
        .end
