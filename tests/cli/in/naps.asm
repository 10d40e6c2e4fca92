; Idle up to the overflows of timer 0, and then the end in idle without interrupts.
.org 0
 rjmp start
.org 0x40
 inc r20
 reti
start:
 ldi r16, 1
 out 0x25, r16
 sts 0x6e, r16
 out 0x33, r16
 sei
again:
 inc r18
 sleep
 inc r19
 cpi r18, 5
 brne again
 cli
 sleep
 rjmp again
