; chip: at89s52
; Directives of sdas8051 that few sources have.
	.module	further
	.area	CSEG	(ABS,CODE)
	.org	0
first	.gblequ	5
second	.lclequ	6
	.gblequ	third, 7
	.lclequ	fourth, 8
fifth	=:	9
	.db	first, second, third, fourth, fifth
	; conditions within a condition, and on one line
	.if	1
	nop
	.iff
	inc	a
	.ift
	dec	a
	.iftf
	rl	a
	.iift	rr a
	.iiff	rrc a
	.iiftf	rlc a
	.endif
	.if	0
	nop
	.iff
	inc	a
	.ift
	dec	a
	.iftf
	rl	a
	.iiff	rrc a
	.else
	swap	a
	.endif
	.iif	1 nop
	.iif	0 inc a
	.iif	1 .db 5
	.iif	2-1, .db 6
	.iif	0, .db 7
	.iifeq	0 dec a
	.iifne	0 rl a
	.iifgt	2 rr a
	.iiflt	2 rlc a
	.iifge	0 rrc a
	.iifle	0 swap a
	; boundaries
	.bndry	4
	inc	a
	.bndry	8
	inc	a
	; what a macro was given
	.macro	count a b c
	.narg	given
	.db	given
	.endm
	count	1, 2
	count	1
	count
	count	1 2 3
	.nval	value, third+2
	.ntyp	type, 5
	.db	value, type
	.mdelete	count
	; arguments between marks of their own
	.macro	move to, from
	mov	to, from
	.endm
	move	^/r0/, ^/#third/
	move	r1 ^|#'a|
	.irp	what ^/acc/, psw
	push	what
	.endm
	.if	#third - 7
	nop
	.endif
	jnb	acc.0, far$
	G$name$0 ==.
far$:	mov	a, #(third + #2)
label::	sjmp	label
	cpl	p1
	mov	a, ti
