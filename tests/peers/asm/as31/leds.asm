; chip: 8052
; LED sequencer with serial port, as31 style
	.equ	baud_const, 255
	.equ	buf, 0x30
	.equ	buflen, 16
	.equ	ticks, buf+buflen
	.flag	running, 0x20.0
	.flag	dirflag, 0x20.1
	.equ	locat, 0x0000
	.org	locat
	ljmp	poweron
	.org	locat+3
	reti
	.org	locat+0x0B
	ljmp	timer0_isr
	.org	locat+0x23
	ljmp	serial_isr
	.org	locat+0x40
poweron:
	mov	sp, #ticks+2
	clr	a
	mov	psw, a
	mov	ie, #10010010b
	mov	pcon, #0x80
	mov	tmod, #00100001b
	mov	tcon, #01010000b
	mov	th1, #baud_const
	mov	scon, #01010010b
	setb	running
	clr	dirflag
	mov	r0, #buf
	mov	r2, #buflen
clrlp:	mov	@r0, #0
	inc	r0
	djnz	r2, clrlp
main:	jnb	running, main
	mov	a, ticks
	cjne	a, #100, notyet
	mov	ticks, #0
	acall	nextled
notyet:	sjmp	main
nextled:
	jb	dirflag, goright
	mov	a, p1
	rl	a
	mov	p1, a
	jnb	acc.7, nl_x
	setb	dirflag
nl_x:	ret
goright:
	mov	a, p1
	rr	a
	mov	p1, a
	jnb	acc.0, gr_x
	clr	dirflag
gr_x:	ret
timer0_isr:
	push	acc
	push	psw
	mov	tl0, #(65536-9216) & 255
	mov	th0, #((65536-9216) >> 8) & 255
	inc	ticks
	pop	psw
	pop	acc
	reti
serial_isr:
	jbc	ri, got
	jbc	ti, ser_x
ser_x:	reti
got:	push	acc
	mov	a, sbuf
	cjne	a, #'g', n1
	setb	running
n1:	cjne	a, #'s', n2
	clr	running
n2:	cjne	a, #13, n3
	mov	dptr, #msg
	lcall	pstr
n3:	pop	acc
	sjmp	ser_x
pstr:	clr	a
	movc	a, @a+dptr
	jz	pstr2
	mov	c, acc.7
	anl	a, #0x7F
	lcall	cout
	jc	pstr2
	inc	dptr
	sjmp	pstr
pstr2:	ret
cout:	jnb	ti, cout
	clr	ti
	mov	sbuf, a
	ret
msg:	.byte	"Hello, world", 13, 10, 0
	.db	'a', 'b', '\n', '\'', "tab\there"
tab:	.word	main, nextled, poweron+3
	.skip	4
	.byte	-1, -127, 0FFh, 1010b, 17o, 0b1h
	.end
