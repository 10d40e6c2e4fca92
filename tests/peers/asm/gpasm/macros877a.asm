; chip: pic16f877a
; reports: 302 303 305 318
	processor 16f877a
	include "p16f877a.inc"
	__CONFIG _HS_OSC & _WDT_OFF & _LVP_OFF & _BODEN_OFF
	radix hex
; macros with local labels, nested, while, variable
	variable i
banksel1 macro reg
	if (reg & 80)
	bsf STATUS,RP0
	else
	bcf STATUS,RP0
	endif
	if reg & 100
	bsf STATUS,RP1
	else
	bcf STATUS,RP1
	endif
	endm
delay	macro	n, cell
	local	again
	movlw	n
	movwf	cell
again	decfsz	cell,f
	goto	again
	endm
mov16	macro	dst, val
	movlw	low (val)
	movwf	dst
	movlw	high (val)
	movwf	dst+1
	endm
	expand
tmp	equ	20
cnt	set	5
cnt	set	cnt+1
	org	0
	clrf	PCLATH
	goto	start
	org	5
start	banksel1 TRISA
	banksel	TRISB
	clrf	TRISB
	banksel	PORTB
	delay	10, tmp
	delay	.200, tmp+1
	mov16	tmp+2, 1234
	mov16	tmp+4, start+cnt
	mov16	tmp+6, D'50000'
i=0
	while i < 4
	movlw	i*2
	call	sub#v(i)
i++
	endw
	if i == 4
	nop
	endif
	ifdef FOO
	goto FOO
	else
	ifndef BAR
	nop
	endif
	endif
	pagesel	far
	call	far
	pagesel	$
	goto	$
sub0	return
sub1	retlw	1
sub2	retlw	2
sub3	fill	3fff,2
	data	1,2,"AB"
	dw	1234,start
	db	1,2,3
	da	"Hello"
	org	800
far	movlw	(far>>8)&0ff
	subwf	tmp,w
	xorwf	tmp,f
	rlf	tmp,1
	rrf	tmp,0
	skpz
	skpnc
	setc
	clrz
	addcf	tmp,f
	negf	tmp
	tstf	tmp
	movfw	tmp
	bz	far
	bnc	far
	b	far
	subcf	tmp,w
	incfsz	tmp
	retfie
	end
