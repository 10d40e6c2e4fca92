; chip: atmega328p
.include "m328Pdef.inc"
.def temp = r16
.def cnt = r17
.equ F_CPU = 16000000
.equ BAUD = 9600
.equ UBRRV = F_CPU/(16*BAUD)-1
.equ LED = PB5
.set N = 3
.cseg
.org 0x0000
	rjmp reset
.org OVF0addr
	rjmp t0
.org INT_VECTORS_SIZE
reset:
	ldi temp, low(RAMEND)
	out SPL, temp
	ldi temp, high(RAMEND)
	out SPH, temp
	sbi DDRB, LED
	ldi temp, (1<<CS02)|(1<<CS00)
	out TCCR0B, temp
	ldi temp, 1<<TOIE0
	sts TIMSK0, temp
	ldi r18, high(UBRRV)
	sts UBRR0H, r18
	ldi r18, low(UBRRV)
	sts UBRR0L, r18
	sei
	ldi ZL, low(2*msg)
	ldi ZH, high(2*msg)
loop:	lpm temp, Z+
	tst temp
	breq done
	rcall putc
	rjmp loop
done:	rjmp PC
	rjmp PC-1
	brne PC+2
	nop
	jmp reset
	call putc
	ldi XL, low(buf)
	ldi XH, high(buf)
	sts buf+1, temp
	lds cnt, count
	ldd r5, Y+N
	std Z+2, r6
	ld r7, -X
	subi temp, -1
	andi temp, ~(1<<3)
	cbr temp, 0x80
	cpi temp, 'A'
	ldi temp, $1F
	ldi temp, 0b1010
	ldi temp, -5
	icall
	movw r24, r16
	ldi r30, low(table)
	ldi r31, high(table)
	ijmp
putc:	lds r18, UCSR0A
	sbrs r18, UDRE0
	rjmp putc
	sts UDR0, temp
	ret
t0:	push temp
	in temp, SREG
	inc cnt
	sbrc cnt, 3
	sbi PINB, LED
	out SREG, temp
	pop temp
	reti
msg:	.db "Hello", 13, 10, 0
odd:	.db 1
table:	.dw reset, putc, 0x1234, msg*2
	.db 'a', 'b', low(1000), high(1000)
.dseg
buf:	.byte 16
count:	.byte 1
.org 0x200
far:	.byte 2
.eseg
ee:	.db 1,2,3
	.dw far
.cseg
	lds temp, far
	ldi temp, ee
.exit
junk here
