; chip: 8051
	.module uart
	.title /UART echo/
	.sbttl "sub"
	.globl _main, _putc
	.globl P1, SBUF
P1	= 0x90
SBUF	= 0x99
SCON	= 0x98
TI	= SCON+1
RI	= 0x98
TMOD	== 0x89
TH1	=: 0x8D
XTAL	.equ 11059200
BAUD	.equ 9600
RELOAD	= 256 - XTAL/12/32/BAUD
	.macro	SEND ch, ?lp
lp:	jnb	TI, lp
	clr	TI
	mov	SBUF, #ch
	.endm
	.macro  PUSHALL
	.irp reg, acc, b, dpl, dph, psw
	push reg
	.endm
	.endm
acc	= 0xE0
b	= 0xF0
dpl	= 0x82
dph	= 0x83
psw	= 0xD0
	.area	REG_BANK_0 (REL,OVR,DATA)
	.ds 8
	.area	DSEG (DATA)
buf:	.ds	16
head:	.ds	1
tail:	.ds	1
	.area	BSEG (BIT)
full:	.ds	1
empty:	.ds	1
	.area	ISEG (DATA)
big:	.ds	40
	.area	XSEG (XDATA)
xbuf:	.ds	256
	.area	SSEG
stack:	.ds	1
	.area	HOME (CODE)
	.area	VECT (ABS,CODE)
	.org	0
	ljmp	start
	.org	0x23
	ljmp	isr
	.area	CSEG (CODE)
start:	mov	sp, #stack - 1
	mov	TMOD, #0x20
	mov	TH1, #RELOAD
	mov	a, #<xbuf
	mov	a, #>xbuf
	mov	dptr, #xbuf + 3
	mov	r0, #buf
	mov	r1, #big
	setb	full
	clr	empty
1$:	jnb	RI, 1$
	clr	RI
	mov	a, SBUF
	add	a, #-'a
	jnc	2$
	SEND	'x
	SEND	^/'y/
2$:	sjmp	1$
sp	= 0x81
isr:	PUSHALL
	.rept	3
	nop
	.endm
	.if	RELOAD - 0xfd
	.error 1
	.else
	mov	a,#RELOAD
	.endif

	.ifeq	BAUD-9600
	inc	a
	.endif
	jb	acc.3, isr
	cpl	psw.5
	mov	c, acc.0
	mov	buf+2, @r0
	mov	buf, #0xff
	reti
_main:	mov	a, (head)
	cjne	a, tail, _main
	cjne	@r1, #0x10+2, _main
	acall	_putc
	ajmp	_main
_putc:	movc	a, @a+dptr
	jmp	@a+dptr
	.irpc	c, ABC
	nop
	.endm
tab:	.byte	1,2,3, buf, head
	.word	tab, _putc, 0x1234
	.ascii	/text/
	.asciz	"zero"
	.db	'a, 'b
	.blkb	2
	.blkw	1
	.even
	.dw	. - tab
	.bndry	8
	.db	1
