; chip: 8052
	.module clock
	.title "Clock with six digits"
	.sbttl "main"
	.globl	_main
	.globl	tick
	T0VAL	=	65536 - 50000
	DIGITS	==	6
	.if	DIGITS - 6
	.error	1
	.else
	NIB	=	0x0f
	.endif
	.area	VECT	(ABS,CODE)
	.org	0
	ljmp	start
	.org	0x000b
	ljmp	isr0
	.area	BITS	(BIT)
blink:	.ds	1
half:	.ds	1
	.area	DSEG	(DATA)
sec:	.ds	1
min:	.ds	1
hour:	.ds	1
tick:	.ds	2
disp:	.ds	DIGITS
	.area	XSEG	(XDATA)
log:	.ds	256
	.area	CSEG	(CODE)
_main:
start:	mov	sp,#disp+DIGITS-1
	mov	tmod,#0x01
	mov	tl0,#<T0VAL
	mov	th0,#>T0VAL
	setb	tr0
	setb	et0
	setb	ea
1$:	jnb	half,1$
	clr	half
	acall	show
	mov	dptr,#log
	mov	a,sec
	movx	@dptr,a
	sjmp	1$
show:	mov	r0,#disp
	mov	r2,#DIGITS
	mov	dptr,#seg7
1$:	mov	a,@r0
	anl	a,#NIB
	movc	a,@a+dptr
	mov	p0,a
	inc	r0
	djnz	r2,1$
	ret
isr0:	push	acc
	push	psw
	mov	tl0,#T0VAL & 0xff
	mov	th0,#(T0VAL >> 8) & 0xff
	inc	tick
	mov	a,tick
	cjne	a,#20,2$
	mov	tick,#0
	cpl	blink
	setb	half
	inc	sec
	mov	a,sec
	cjne	a,#60,2$
	mov	sec,#0
	inc	min
2$:	pop	psw
	pop	acc
	reti
	.macro	dig a,b,c
	.db	a,b,c
	.endm
seg7:	dig	0x3f,0x06,0x5b
	dig	0x4f,0x66,0x6d
	.db	0x7d,0x07,0x7f,0x6f
	.dw	start,show,seg7+3
	.ascii	"ver 1.0"
	.asciz	/it's "ok"/
	.strz	"abc"
	.even
	.rept	3
	nop
	.endm
	.irp	v,1,2,3
	.db	v*2
	.endm
	.irpc	c,abc
	.ascii	"c"
	.endm
	.area	CONST	(CODE)
tbl:	.db	#<start,#>start,tbl-tbl
