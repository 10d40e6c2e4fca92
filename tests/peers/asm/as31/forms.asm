; chip: 8052
	.org 0
	ajmp start
	.org 0x30
start:	mov 0x30, #10
	mov @r0, 0x20
	mov r7, 0x31
	mov 0x32, r6
	mov 0x33, 0x34
	mov 0x33, @r1
	mov dptr, #table
	orl c, /0x20.7
	anl c, 0x2f.0
	mov psw.5, c
	mov c, f0
	xch a, @r1
	xchd a, @r0
	swap a
	da a
	mul ab
	div ab
	movx a, @r0
	movx @r1, a
	jmp @a+dptr
	cjne @r1, #5, start
	cjne r7, #table-start, start
	cjne a, 0x30, start
	djnz 0x30, start
	jb acc.3, start
	jbc 0x21.2, start
	sjmp *
	sjmp *+2
	jc  *-4
	.skip 0x80
	djnz r3, *
table:	.byte 1,2,3
	.word table, start
	.org 0x900
far:	ret
