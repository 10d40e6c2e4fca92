; chip: atmega328p
.include "m328Pdef.inc"
.equ BOOTSTART = 0x3F00
.org BOOTSTART
	ldi r16, high(RAMEND)
	out SPH, r16
	ldi ZH, high(BOOTSTART<<1)
	ldi ZL, LOW(BOOTSTART<<1)
wait:	in r16, SPMCSR
	sbrc r16, SELFPRGEN
	rjmp wait
	ldi r17, (1<<PGERS) + (1<<SELFPRGEN)
	out SPMCSR, r17
	spm
	ldi r20, PAGESIZE*2
	ldi r21, high(app)
	jmp app

.org 0
app:	rjmp app
; 16 bit math
	.def	mc16uL	=r16
	.def	mc16uH	=r17
	.def	mp16uL	=r18
	.def	m16u0	=r18
mpy16u:	clr	m16u0
	ldi	r24,16
	lsr	mp16uL
m16u_1:	brcc	noad8
	add	m16u0,mc16uL
	adc	r19,mc16uH
noad8:	ror	m16u0
	dec	r24
	brne	m16u_1
	ret
