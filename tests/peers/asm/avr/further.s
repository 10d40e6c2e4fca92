; chip: atmega328p
; Directives of the GNU assembler that few sources have. The program begins behind a gap.
	.org	0x10
start:	rjmp	start
	. = 0x18
	. = . + 2
	.org	0x20, 0xaa
	.octa	1, 0x112233445566778899aabbccddeeff00
	.quad	0x1122334455667788, -2
	.sleb128	-5, 300, 0, -129
	.uleb128	300, 5, 0
	.dc.b	1, 2
	.dc.w	3
	.dc.l	4
	.dc	9
	.dcb.b	3, 5
	.dcb.w	2, 1
	.dcb.l	1, -1
	.dcb	2, 7
	.ds.b	3, 5
	.ds.w	2
	.ds.l	1, 6
	.ds	2, 1
	.string16	"ab"
	.string32	"a"
	.string64	"b"
	.ascii	"one" "two", "three"
	.asciz	"one" "two"
	.incbin	"tick.inc"
	.incbin	"tick.inc", 2
	.incbin	"tick.inc", 2, 3
	.ifeqs	"a", "a"
	.byte	1
	.endif
	.ifnes	"a", "a"
	.byte	2
	.else
	.byte	3
	.endif
	.if	0
	.err
	.abort
	.endif
	.balign	4
	.byte	1, 2
	.balignw	4, 0x1234
	.balignl	8, 0x12345678
	.p2align	4, , 3
	.p2align	2, 0xee, 3
	.byte	1, 2
	.p2alignw	3, 0xabcd
	.struct	4
field:	.skip	2
next:	.space	1
	.offset	1
other:	.skip	3
size:
	.text
	.byte	field, next, other, size
	.macro	two a=5, b
	.byte	\a, \b
	.endm
	two	, 3
	two	1 2
	two	b=7
	.macro	call
	.byte	\@
	.endm
	call
	call
	.altmacro
	.macro	values first, rest
	LOCAL	here
here:	.byte	first, rest, . - here
	.endm
	values	%(1 + 2), 4
	values	<5, 6>, 7
	.noaltmacro
	.version	"1"
	.line	3
	.psize	10
	.sbttl	"x"
	.eject
	.balign	2
last:	rjmp	last
