; chip: atmega328p
; uart echo for m328p, avr-as
	.equ	F_CPU, 16000000
	.equ	BAUD, 9600
	.equ	UBRR, F_CPU/16/BAUD-1
	.set	UCSR0A, 0xC0
	.set	UCSR0B, 0xC1
	.set	UDR0, 0xC6
	.set	SPL, 0x3d
	.set	RAMEND, 0x8ff
	.macro	sti16 addr, val
	ldi	r24, lo8(\val)
	sts	\addr, r24
	ldi	r24, hi8(\val)
	sts	\addr+1, r24
	.endm
	.macro	pushall a, b=r1, rest:vararg
	push	\a
	push	\b
	.ifnb	\rest
	pushall	\rest
	.endif
	.endm
	.section .vectors,"ax",@progbits
	jmp	main
	.rept	25
	jmp	bad
	.endr
	.text
	.global	main
	.type	main, @function
main:	ldi	r28, lo8(RAMEND)
	ldi	r29, hi8(RAMEND)
	out	SPL+1, r29
	out	SPL, r28
	clr	r1
	sti16	0xC4, UBRR
	ldi	r24, (1<<4)|(1<<3)
	sts	UCSR0B, r24
	pushall	r2, r3, r4, r5
	pushall	r2
	ldi	r30, lo8(hello)
	ldi	r31, hi8(hello)
1:	lpm	r24, Z+
	tst	r24
	breq	2f
	rcall	putc
	rjmp	1b
2:	rcall	getc
	cpi	r24, 'a'
	brlo	3f
	cpi	r24, 'z'+1
	brsh	3f
	subi	r24, 'a'-'A'
3:	rcall	putc
	rjmp	2b
	.size	main, .-main
putc:	lds	r25, UCSR0A
	sbrs	r25, 5
	rjmp	putc
	sts	UDR0, r24
	ret
getc:	lds	r25, UCSR0A
	sbrs	r25, 7
	rjmp	.-8
	lds	r24, UDR0
	ret
bad:	reti
	.word	gs(putc), pm(getc), main, bad-main
	ldi	r30, pm_lo8(putc)
	ldi	r31, pm_hi8(putc)
	ldi	r30, lo8(gs(putc))
	ldi	r30, lo8(-(tab))
	subi	r30, lo8(-(hello))
	sbci	r31, hi8(-(hello))
	.section .progmem.data,"a",@progbits
hello:	.asciz	"Hello \"AVR\"\r\n"
	.balign	4, 0xEE
tab:	.byte	1, 2, 'x', '\n', 0x7f, 0b101, 017
	.short	1000, -1
	.long	0x12345678, main
	.fill	3, 2, 0x1234
	.skip	2, 0xAA
	.ascii	"a", "bc"
	.irp	x, 1, 2, 3
	.byte	\x*\x
	.endr
	.irpc	c, 012
	.byte	'\c'
	.endr
	.set	i, 0
	.rept	4
	.byte	i
	.set	i, i+1
	.endr
	.if	i == 4 && BAUD > 1000
	.byte	0xA5
	.elseif	i == 5
	.byte	0x5A
	.else
	.err
	.endif
	.ifdef	NOPE
	.byte	9
	.endif
	.data
v:	.word	0x1122
	.section .bss
w:	.skip	4
	.section .noinit,"aw",@nobits
z:	.skip	1
	.text
	lds	r0, v
	lds	r0, w+1
	sts	z, r0
	lds	r0, buf2
	.comm	buf2, 8, 1
