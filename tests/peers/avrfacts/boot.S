/*
 * Self-programming. The code that writes flash is in the boot section, from 0x7000 with the fuses of a new chip. Each function returns the
 * value of one fact, in r25:r24.
 */
#define __SFR_OFFSET 0
#include <avr/io.h>

.macro fact name
	.global	f_\name
f_\name:
.endm

	.text
/* LPM from r30 directly after BLBSET. */
read_bits:
	clr	r31
	ldi	r24, 1 << BLBSET | 1 << SELFPRGEN
	out	SPMCSR, r24
	lpm	r24, Z
	clr	r25
	ret

fact fuse_high
	ldi	r30, 3
	rjmp	read_bits

fact lock_bits
	ldi	r30, 1
	rjmp	read_bits

	.balign	128
target:	.fill	128, 1, 0x5A

	.section .boot, "ax", @progbits
point:	ldi	r30, lo8(target)
	ldi	r31, hi8(target)
	ret

/* A command for the page that contains Z. */
command:
	out	SPMCSR, r24
	spm
	ret

/* Waits until SPMCSR is free, 20 ms at most. */
wait:	clr	r20
	clr	r21
1:	in	r22, SPMCSR
	sbrs	r22, SELFPRGEN
	ret
	subi	r20, 1
	sbci	r21, 0
	brne	1b
	ret

/* The application section can be read again. */
finish:	rcall	wait
	ldi	r22, 1 << RWWSRE | 1 << SELFPRGEN
	out	SPMCSR, r22
	spm
	ret

erase:	rcall	point
	ldi	r24, 1 << PGERS | 1 << SELFPRGEN
	rjmp	command

/* RWWSB after an SPM a given number of cycles after the write to SPMCSR. */
.macro window name, count
fact \name
	rcall	point
	ldi	r24, 1 << PGERS | 1 << SELFPRGEN
	out	SPMCSR, r24
	.rept	\count
	nop
	.endr
	spm
	nop
	nop
	in	r24, SPMCSR
	rcall	finish
	clr	r25
	bst	r24, RWWSB
	clr	r24
	bld	r24, 0
	ret
.endm
	window	spm_window_4, 3
	window	spm_window_5, 4

/* Does r19:r18, at clk/8, have a value between 3.7 and 4.5 ms? */
typical:
	clr	r24
	clr	r25
	subi	r18, lo8(7400)
	sbci	r19, hi8(7400)
	brcs	1f
	subi	r18, lo8(1600)
	sbci	r19, hi8(1600)
	brcc	1f
	inc	r24
1:	ldi	r22, 1
	sts	TCCR1B, r22
	ret

slow:	ldi	r22, 2
	sts	TCCR1B, r22
	sts	TCNT1H, r1
	sts	TCNT1L, r1
	ret

fact spm_time
	rcall	slow
	rcall	erase
	rcall	wait
	lds	r18, TCNT1L
	lds	r19, TCNT1H
	rcall	finish
	rjmp	typical

/* A page of the section that cannot be read while it is written: the core halts. */
fact spm_nrww
	rcall	slow
	ldi	r30, lo8(0x7F80)
	ldi	r31, hi8(0x7F80)
	ldi	r24, 1 << PGERS | 1 << SELFPRGEN
	rcall	command
	lds	r18, TCNT1L
	lds	r19, TCNT1H
	rcall	finish
	rjmp	typical

/* The first byte of flash while a page is erased. */
fact spm_busy
	rcall	erase
	clr	r30
	clr	r31
	nop
	nop
	lpm	r24, Z
	rcall	finish
	clr	r25
	ret

/* RWWSB when it is erased (2), and after RWWSRE (1). */
fact spm_rww
	rcall	erase
	rcall	wait
	in	r23, SPMCSR
	rcall	finish
	in	r22, SPMCSR
	clr	r24
	clr	r25
	bst	r23, RWWSB
	bld	r24, 1
	bst	r22, RWWSB
	bld	r24, 0
	ret

fact spm_erase
	rcall	erase
	rcall	finish
	rcall	point
	lpm	r24, Z+
	lpm	r25, Z
	ret

/* A word to the buffer, and the buffer to the page. */
fact spm_write
	rcall	erase
	rcall	wait
	rcall	point
	ldi	r22, 0x34
	ldi	r23, 0x12
	movw	r0, r22
	ldi	r24, 1 << SELFPRGEN
	rcall	command
	ldi	r24, 1 << PGWRT | 1 << SELFPRGEN
	rcall	command
	clr	r1
	rcall	finish
	rcall	point
	lpm	r24, Z+
	lpm	r25, Z
	ret

/* EEPE after a start while a page is erased. */
fact ee_spm
	rcall	erase
	sbi	EECR, EEMPE
	sbi	EECR, EEPE
	in	r23, EECR
	rcall	finish
	clr	r24
	clr	r25
	bst	r23, EEPE
	bld	r24, 0
	ret
