; chip: atmega328p
; macros, conditionals
.nolist
.include "m328Pdef.inc"
.list
.macro ldi16
	ldi @0, low(@2)
	ldi @1, high(@2)
.endm
.macro outi
	ldi r16, @1
.if @0 > 0x3F
	sts @0, r16
.else
	out @0, r16
.endif
.endmacro
.macro delay
	ldi r20, @0
l1:	dec r20
	brne l1
.endmacro
#define DEBUG 1
.equ A = 5
.ifdef DEBUG
	nop
.else
	ret
.endif
.ifndef FOO
	nop
.endif
.if A == 5 && A < 6
	inc r1
.elif A == 6
	inc r2
.else
	inc r3
.endif
.org 0x40
start:	ldi16 r24, r25, start
	outi DDRD, 0xFF
	outi UCSR0B, (1<<RXEN0)|(1<<TXEN0)
	delay 5
	delay 10
	ldi r16, byte1(0x123456)
	ldi r16, byte2(0x123456)
	ldi r16, byte3(0x123456)
	ldi r17, A*2+1
	ldi r17, A<<2+1
	ldi r17, (A|8)^3
	ldi r17, 100/7%4
	ldi r18, A>=5
	ldi r19, 0x10 | 1<<2 & 7
	sbis PIND, PD2
	rjmp START
	sbiw ZL, 1
	adiw r26, 63
	muls r16, r17
	bst r0, 3
	brbs 1, start
	brts start
	cli
	sleep
	wdr
	.db "odd"
	.db "x",0
	.dw -1
