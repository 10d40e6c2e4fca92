; Idle until timer 0 has run over, and then the end in idle without interrupts.
 .org 0
 ljmp start
 .org 0x0b
 inc r0
 reti
 .org 0x30
start: mov tl0, #0x80
 mov tmod, #1
 mov th0, #0xfe
 mov ie, #0x82
 setb tcon.4
 orl pcon, #1
 nop
 nop
 clr ie.7
 orl pcon, #1
 nop
