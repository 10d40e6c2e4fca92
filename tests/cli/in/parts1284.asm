; The flag of PCINT3, then timer 3 and the second serial port of an ATmega1284 by their interrupts.
.org 0
 jmp start
.org 0x78
 inc r21
 reti
.org 0x88
 inc r22
 reti
.org 0x90
start:
 ldi r16, 0x40
 out 0x3e, r16
 ldi r16, 0xff
 out 0x3d, r16
 ldi r16, 0x80
 sts 0x73, r16
 sbi 0x0a, 7
 sbi 0x0b, 7
 nop
 nop
 nop
 nop
 in r20, 0x1b
 ldi r16, 1
 out 0x33, r16
 sei
 sts 0x71, r16
 ldi r17, 0xff
 sts 0x95, r17
 sts 0x94, r17
 sts 0x91, r16
 sleep
 sts 0x71, r1
 lds r18, 0x90
 lds r18, 0x91
 ldi r16, 0x48
 sts 0xc9, r16
 ldi r16, 0x55
 sts 0xce, r16
 sleep
 lds r18, 0xc9
 lds r18, 0xca
 mov r0, r20
 add r0, r21
 add r0, r22
 cli
 sleep
