/*
 * Cycles of instructions and of interrupts. Each function returns the value of one fact, in r25:r24. The stopwatch is timer 1,
 * which counts cycles while these run; register addresses are those of IN and OUT.
 */
#define __SFR_OFFSET 0
#include <avr/io.h>

.macro fact name
	.global	f_\name
f_\name:
.endm

/* Reads the stopwatch; the two loads of a reading are between readings, and are subtracted. */
.macro start
	lds	r18, TCNT1L
	lds	r19, TCNT1H
.endm

.macro stop
	lds	r24, TCNT1L
	lds	r25, TCNT1H
	sub	r24, r18
	sbc	r25, r19
	sbiw	r24, 4
.endm

.macro finish
	stop
	ret
.endm

.macro nops count
	.rept	\count
	nop
	.endr
.endm

/* A fact whose value is the cycles of up to five lines of code; registers have the values from `begin`. */
.macro cycles name, a, b, c, d, e
	fact	\name
	begin
	start
	\a
	\b
	\c
	\d
	\e
	finish
.endm

.macro begin
	ldi	r26, lo8(cell)
	ldi	r27, hi8(cell)
	movw	r30, r26
	ldi	r20, 0
	ldi	r21, 1
	tst	r20		; Z is set
.endm

.lcomm	cell, 4
	.equ	IO, GPIOR0

	.text
	cycles	nop, "nop"
	cycles	add, "add r20, r21"
	cycles	movw, "movw r22, r20"
	cycles	adiw, "adiw r26, 1"
	cycles	mul, "mul r20, r21"
	cycles	fmul, "fmul r20, r21"
	cycles	rjmp, "rjmp ."
	cycles	jmp, "jmp 1f", "1:"
	cycles	rcall, "rcall 1f", "rjmp 2f", "1: ret", "2:"
	cycles	call, "call 1f", "rjmp 2f", "1: ret", "2:"
	cycles	push, "push r20", "pop r20"
	cycles	branch_not, "brne 1f", "1:"
	cycles	branch_taken, "breq 1f", "1:"
	cycles	cpse_0, "cpse r20, r21", "1:"
	cycles	cpse_1, "cpse r20, r20", "mov r22, r22"
	cycles	cpse_2, "cpse r20, r20", "lds r22, cell"
	cycles	sbrs_0, "sbrs r20, 0"
	cycles	sbrs_1, "sbrs r21, 0", "mov r22, r22"
	cycles	sbrs_2, "sbrs r21, 0", "lds r22, cell"
	cycles	sbic_0, "sbis IO, 0"
	cycles	sbic_1, "sbic IO, 0", "mov r22, r22"
	cycles	sbic_2, "sbic IO, 0", "lds r22, cell"
	cycles	ld, "ld r22, X"
	cycles	ld_inc, "ld r22, X+"
	cycles	ld_dec, "ld r22, -X"
	cycles	ldd, "ldd r22, Z+2"
	cycles	lds, "lds r22, cell"
	cycles	st, "st X, r20"
	cycles	st_inc, "st X+, r20"
	cycles	std, "std Z+2, r20"
	cycles	sts, "sts cell, r20"
	cycles	lpm, "lpm r22, Z"
	cycles	lpm_inc, "lpm r22, Z+"
	cycles	in, "in r22, IO"
	cycles	out, "out IO, r20"
	cycles	sbi, "sbi IO, 7"
	cycles	cbi, "cbi IO, 7"
	cycles	wdr, "wdr"

fact ijmp
	ldi	r30, pm_lo8(1f)
	ldi	r31, pm_hi8(1f)
	start
	ijmp
1:	finish

fact icall
	ldi	r30, pm_lo8(2f)
	ldi	r31, pm_hi8(2f)
	start
	icall
	rjmp	1f
2:	ret
1:	finish

/* The stopwatch time of the watchdog's interrupt, and the number of interrupts; the count survives a reset. */
	.comm	wd_at, 2
	.section .noinit, "aw", @nobits
	.global	wd_count
wd_count:
	.skip	1
	.text

/* Interrupts. */

	.global	TIMER0_COMPA_vect
TIMER0_COMPA_vect:
	reti
	.global	TIMER0_COMPB_vect
TIMER0_COMPB_vect:
	mov	r20, r18
	reti
	.global	TIMER0_OVF_vect
TIMER0_OVF_vect:
	mov	r21, r18
	reti
	.global	TIMER1_COMPA_vect
TIMER1_COMPA_vect:
	push	r24
	lds	r20, TCNT1L
	pop	r24
	reti
	.global	TIMER2_COMPA_vect
TIMER2_COMPA_vect:
	lds	r20, TCNT1L
	lds	r21, TCNT1H
	reti
	.global	TIMER1_COMPB_vect
TIMER1_COMPB_vect:
	in	r20, TIFR1
	reti
	.global	WDT_vect
WDT_vect:
	push	r24
	lds	r24, TCNT1L
	sts	wd_at, r24
	lds	r24, TCNT1H
	sts	wd_at + 1, r24
	lds	r24, wd_count
	subi	r24, -1		; flags are of no use where this interrupts
	sts	wd_count, r24
	pop	r24
	reti
	.global	INT0_vect
INT0_vect:
	inc	r20
	reti

/* Stops interrupts and timer 0, and returns r24. */
quiet:
	out	TCCR0B, r1
	out	TCCR0A, r1
	sts	TIMSK0, r1
	clr	r25
	ret

/* Leaves OCF0B and TOV0 set, timer 0 stopped, and the interrupts of r22 enabled; counts from zero in r18. */
	.global	pend
pend:
	out	TCCR0A, r1
	sts	TIMSK0, r22
	ldi	r24, 250
	out	OCR0B, r24
	ldi	r24, 7
	out	TIFR0, r24
	ldi	r24, 1
	out	TCCR0B, r24
	out	TCNT0, r1
	ldi	r24, 100
1:	dec	r24
	brne	1b
	out	TCCR0B, r1
	clr	r18
	ser	r20
	ser	r21
	ret

.macro count_up
	.rept	4
	inc	r18
	.endr
	cli
.endm

/* 60 NOPs with an empty interrupt among them. */
fact irq
	ldi	r24, 30
	out	OCR0A, r24
	out	TCNT0, r1
	ldi	r24, 7
	out	TIFR0, r24
	ldi	r24, 1 << OCIE0A
	sts	TIMSK0, r24
	ldi	r24, 1
	sei
	out	TCCR0B, r24
	start
	nops	60
	stop
	cli
	push	r25
	rcall	quiet
	pop	r25
	ret

/* Instructions that run after SEI before a pending interrupt. */
fact sei
	ldi	r22, 1 << OCIE0B
	rcall	pend
	sei
	count_up
	mov	r24, r20
	rjmp	quiet

/* Instructions that run after an OUT that sets I, before a pending interrupt. */
fact out_sreg
	ldi	r22, 1 << OCIE0B
	rcall	pend
	ldi	r24, 0x80
	out	SREG, r24
	count_up
	mov	r24, r20
	rjmp	quiet

/* Instructions between RETI and the next, pending interrupt. */
fact reti
	ldi	r22, 1 << OCIE0B | 1 << TOIE0
	rcall	pend
	sei
	count_up
	mov	r24, r21
	sub	r24, r20
	rjmp	quiet

/* SLEEP after SEI precedes the pending interrupt: counts the instructions from SLEEP to the interrupt. */
fact sei_sleep
	ldi	r22, 1 << OCIE0B
	rcall	pend
	ldi	r24, 1
	out	SMCR, r24
	sei
	sleep
	count_up
	out	SMCR, r1
	mov	r24, r20
	rjmp	quiet

/* Low level: one instruction runs between two interrupts while the level is low. */
fact int_level
	cbi	PORTD, 2
	sbi	DDRD, 2
	sts	EICRA, r1
	nops	4
	sbi	EIMSK, 0
	clr	r20
	sei
	nops	10
	cli
	cbi	EIMSK, 0
	cbi	DDRD, 2
	mov	r24, r20
	clr	r25
	ret

/* From the match to the stopwatch's reading in the service routine, after entry, JMP and PUSH. */
fact latency
	sts	TIMSK1, r1
	sts	OCR1AH, r1
	ldi	r24, 40
	sts	OCR1AL, r24
	sts	TCNT1H, r1
	sts	TCNT1L, r1
	ldi	r24, 0x27
	out	TIFR1, r24
	ldi	r24, 1 << OCIE1A
	sts	TIMSK1, r24
	clr	r20
	sei
	nops	80
	cli
	sts	TIMSK1, r1
	mov	r24, r20
	subi	r24, 40
	clr	r25
	ret

/* The time at which an interrupt is served, counted from a fixed point before it, with r22 as SMCR. */
.macro arrival name, waiting:vararg
	.global	\name
\name:	ldi	r24, 100
	sts	OCR2A, r24
	sts	TCNT2, r1
	ldi	r24, 7
	out	TIFR2, r24
	ldi	r24, 1 << OCIE2A
	sts	TIMSK2, r24
	ldi	r24, 1
	out	SMCR, r24
	sei
	sts	TCCR2B, r24
	start
	\waiting
	cli
	sts	TCCR2B, r1
	sts	TIMSK2, r1
	out	SMCR, r1
	movw	r24, r20
	sub	r24, r18
	sbc	r25, r19
	ret
.endm
	arrival	awake, nops 150
	arrival	asleep, sleep

/* TIFR1 in the service routine of OCF1B. */
fact flag_taken
	rcall	match_40
	ldi	r24, 1 << OCIE1B
	sts	TIMSK1, r24
	ser	r20
	sei
	nops	60
	cli
	sts	TIMSK1, r1
	mov	r24, r20
	andi	r24, 1 << OCF1B
	clr	r25
	ret

/* OCF1A and OCF1B about 40 cycles from now. */
match_40:
	sts	TIMSK1, r1
	ldi	r24, 60
	sts	OCR1AH, r1
	sts	OCR1AL, r24
	sts	OCR1BH, r1
	sts	OCR1BL, r24
	sts	TCNT1H, r1
	sts	TCNT1L, r1
	ldi	r24, 0x27
	out	TIFR1, r24
	ret

/* An interrupt in each of the three cycles of LPM, which ends first: the sum of the waiting cycles above the minimum. */
.macro phase count
	rcall	match_40
	ldi	r24, 1 << OCIE1A
	sts	TIMSK1, r24
	sei
	nops	\count
	.rept	30
	lpm	r22, Z
	.endr
	cli
	add	r23, r20
	cp	r21, r20
	brlo	1f
	mov	r21, r20
1:
.endm

fact irq_multi
	clr	r23
	ser	r21
	phase	0
	phase	1
	phase	2
	sts	TIMSK1, r1
	mov	r24, r23
	sub	r24, r21
	sub	r24, r21
	sub	r24, r21
	clr	r25
	ret

/* Two interrupts are pending: is the one with the lower vector served first? */
fact priority
	ldi	r22, 1 << OCIE0B | 1 << TOIE0
	rcall	pend
	sei
	count_up
	clr	r24
	cp	r20, r21
	brsh	1f
	inc	r24
1:	rjmp	quiet
