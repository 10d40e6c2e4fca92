; chip: atmega328p
; DS18B20 bit bang for avr-as
.equ	PORTD, 0x0B
.equ	DDRD, 0x0A
.equ	PIND, 0x09
.set	OW, 3
temp	= 16
zero	= 1
	.text
	.irpc	d,0123
	ldi	r2\d, 0x\d
	.endr
	.irp	reg, r18,r19
	clr	\reg
	.endr
	.org	0x20
ow_reset:
	sbi	DDRD, OW
	cbi	PORTD, OW
	ldi	r24, lo8(480*4)
	ldi	r25, hi8(480*4)
0:	sbiw	r24, 1
	brne	0b
	cbi	DDRD, OW
	rcall	us70
	in	temp, PIND
	bst	temp, OW
	ret
us70:	ldi	r24, 280 & 0xff
1:	dec	r24
	brne	1b
	ret
ow_write:
	ldi	r20, 8

2:	ror	r16
	brcc	3f
	sbi	PORTD, OW
	rjmp	4f
3:	cbi	PORTD, OW
4:	dec	r20
	brne	2b
	ret
crc8:	mov	r0, zero
	.ifdef	NOPE
	.err
	.elseif 1
	eor	r0, temp
	.else
	nop
	.endif
	.if	OW == 3 && 1
	lsr	r0
	.endif
	.ifc	a,a
	nop
	.endif
	.ifb
	nop
	.endif
	.subsection 1
late:	ldi	r16, 1
	ret
	.subsection 0
	rcall	late
	.text 2
last:	ldi	r17, 2
	.text 1
	nop
	.text
	rcall	last
	.section .text.init,"ax"
	nop
	.subsection 3
	inc r5
	.previous
	rjmp	.+2
	.data
a:	.byte 1
	.data 1
b:	.byte 2
	.data 0
c:	.byte 3
	.align 1
	.text
	lds r16, a
	lds r16, b
	lds r16, c
	.byte 1,1
	.subsection 5
	.byte 2
	.balign 4
	.byte 3,4
