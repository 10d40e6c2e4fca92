; chip: atmega328p
; Common variables of C, which the linker orders by its table of names, and local ones, which come before them.
        .comm zeta,2
        .comm alpha,1
        .comm mid,4,2
        .local own
        .comm own,3
        .comm beta,3
        .comm x1,1,4
        .lcomm one,2
        .comm a2,8,8
        .comm alpha,1
        .local rx
        .comm rx,5,2
        .comm rxbuf,16
        .comm head,1,1
        .comm tail,1,1
        .section .bss
q:      .skip 3
        .data
d:      .byte 1,2,3
        .text
main:   lds r16, head
        sts tail, r16
        ldi r30, lo8(rxbuf)
        ldi r31, hi8(rxbuf)
        .word zeta,alpha,mid,beta,x1,one,a2,own,rx,head,tail,q,d
1:      dec r16
        brne 1b
        rjmp 2f
1:      rjmp 1b
2:      rjmp 1f
        .macro wait n
        ldi r17, \n
1:      dec r17
        brne 1b
        .endm
        wait 4
1:      wait 5
        rjmp 1b
