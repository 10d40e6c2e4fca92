/* The peripherals around the core, cycle by cycle. Each function returns the value of one fact, in r25:r24. */
#define __SFR_OFFSET 0
#include <avr/io.h>

.macro fact name
	.global	f_\name
f_\name:
.endm

.macro nops count
	.rept	\count
	nop
	.endr
.endm

.macro give bit, reg
	clr	r25
	clr	r24
	sbrc	\reg, \bit
	inc	r24
	ret
.endm

	.text
/* Pins. */
.macro pin_after name, count
fact \name
	cbi	PORTB, 1
	sbi	DDRB, 1
	nops	4
	sbi	PORTB, 1
	nops	\count
	in	r22, PINB
	cbi	DDRB, 1
	give	1, r22
.endm
	pin_after pin_next, 0
	pin_after pin_later, 1

/* PINB written with two ones, PORTB before it 5. */
fact pin_toggle
	ldi	r22, 5
	out	PORTB, r22
	ldi	r22, 7
	out	DDRB, r22
	nops	4
	ldi	r22, 3
	out	PINB, r22
pins_end:
	nops	4
	in	r24, PORTB
	out	DDRB, r1
	out	PORTB, r1
	clr	r25
	ret

fact pin_sbi
	ldi	r22, 5
	out	PORTB, r22
	ldi	r22, 7
	out	DDRB, r22
	nops	4
	sbi	PINB, 1
	rjmp	pins_end

/* A pull-up with PUD set, after the pin was low. */
fact pud
	cbi	PORTC, 0
	sbi	DDRC, 0
	ldi	r22, 1 << PUD
	out	MCUCR, r22
	nops	4
	cbi	DDRC, 0
	sbi	PORTC, 0
	nops	4
	in	r22, PINC
	out	MCUCR, r1
	cbi	PORTC, 0
	give	0, r22

/* Timer 0 at the clock of the core, in normal mode, without flags, TCNT0 = r22 and OCR0A = 60. */
run0:
	out	TCCR0B, r1
	out	TCCR0A, r1
	ldi	r24, 60
	out	OCR0A, r24
	ldi	r24, 1
	out	TCCR0B, r24
	ldi	r24, 7
	out	TIFR0, r24
	ret

fact tcnt_next
	rcall	run0
	ldi	r22, 100
	out	TCNT0, r22
	in	r24, TCNT0
	out	TCCR0B, r1
	clr	r25
	ret

fact tcnt_later
	rcall	run0
	ldi	r22, 100
	out	TCNT0, r22
	nop
	in	r24, TCNT0
	out	TCCR0B, r1
	clr	r25
	ret

/* TCNT0 written with the value of OCR0A. */
fact tcnt_hides
	rcall	run0
	ldi	r22, 60
	ldi	r24, 7
	out	TIFR0, r24
	out	TCNT0, r22
	nops	8
	in	r22, TIFR0
	out	TCCR0B, r1
	give	1, r22

/* OCF0A after OUT to TCNT0 of 50, OUT to TIFR0, and r24 NOPs, at least two; IJMP replaces two of them. */
	.global	match_after
match_after:
	mov	r23, r24
	rcall	run0
	ldi	r30, pm_lo8(1f)
	ldi	r31, pm_hi8(1f)
	subi	r23, 2
	sub	r30, r23
	sbc	r31, r1
	ldi	r22, 50
	ldi	r24, 7
	out	TCNT0, r22
	out	TIFR0, r24
	ijmp
	nops	40
1:	in	r22, TIFR0
	out	TCCR0B, r1
	give	1, r22

/* TCNT0 read twice, 100 cycles apart. */
fact ctc_period
	rcall	run0
	ldi	r24, 99
	out	OCR0A, r24
	ldi	r24, 1 << WGM01
	out	TCCR0A, r24
	nops	250
	in	r22, TCNT0
	nops	99
	in	r24, TCNT0
	out	TCCR0B, r1
	out	TCCR0A, r1
	sub	r24, r22
	clr	r25
	ret

/* Prescaler. */
fact tsm
	rcall	run0
	ldi	r22, 2
	out	TCCR0B, r22
	ldi	r22, 1 << TSM | 1 << PSRSYNC
	out	GTCCR, r22
	in	r22, TCNT0
	nops	50
	in	r24, TCNT0
	out	GTCCR, r1
	out	TCCR0B, r1
	sub	r24, r22
	clr	r25
	ret

.macro tick name, count
fact \name
	rcall	run0
	ldi	r22, 3
	out	TCCR0B, r22
	nops	33
	ldi	r22, 1 << PSRSYNC
	out	GTCCR, r22
	out	TCNT0, r1
	nops	\count
	in	r24, TCNT0
	out	TCCR0B, r1
	clr	r25
	ret
.endm
	/* OUT GTCCR in cycle t: the first tick is at the edge t + 1 + 64, so IN in cycle t + 65 is the first to see it. */
	tick	psr_before, 62
	tick	psr_at, 63

/* Both timers at clk/64, started 3 and 24 cycles after PSRSYNC: the sum of their ticks up to 75 cycles after it. */
fact shared_psr
	rcall	run0
	out	TCCR0B, r1
	sts	TCCR1B, r1
	in	r20, TCNT0
	lds	r21, TCNT1L
	ldi	r22, 1 << PSRSYNC
	ldi	r23, 3
	out	GTCCR, r22
	nop
	sts	TCCR1B, r23
	nops	20
	out	TCCR0B, r23
	nops	50
	in	r24, TCNT0
	lds	r25, TCNT1L
	out	TCCR0B, r1
	sub	r24, r20
	sub	r25, r21
	add	r24, r25
	clr	r25
	ldi	r22, 1
	sts	TCCR1B, r22
	ret

/* 16-bit registers. The counter is written while its clock is slow. */
fact temp_latch
	ldi	r22, 0x12
	sts	TCNT1H, r22
	ldi	r22, 0xF0
	sts	TCNT1L, r22
	lds	r22, TCNT1L
	nops	30
	lds	r24, TCNT1H
	clr	r25
	ret

fact temp_shared
	ldi	r22, 5
	sts	TCCR1B, r22
	ldi	r22, 0x12
	sts	OCR1AH, r22
	ldi	r22, 0x34
	sts	TCNT1L, r22
	rjmp	read1

fact temp_ocr
	ldi	r22, 5
	sts	TCCR1B, r22
	ldi	r22, 0x56
	sts	OCR1AH, r22
	sts	OCR1AL, r22
	ldi	r22, 0x12
	sts	TCNT1H, r22
	lds	r22, OCR1AL
	ldi	r22, 0x34
	sts	TCNT1L, r22
read1:
	lds	r24, TCNT1L
	lds	r25, TCNT1H
	ldi	r22, 1
	sts	TCCR1B, r22
	ret

/* Cycles from the stopwatch's reading to the capture of a rising edge of ICP1; r24 is TCCR1B. */
	.global	capture
capture:
	cbi	PORTB, 0
	sbi	DDRB, 0
	sts	TCCR1B, r24
	nops	20
	lds	r18, TCNT1L
	lds	r19, TCNT1H
	sbi	PORTB, 0
	nops	20
	lds	r24, ICR1L
	lds	r25, ICR1H
	sub	r24, r18
	sbc	r25, r19
	cbi	DDRB, 0
	cbi	PORTB, 0
	ldi	r22, 1
	sts	TCCR1B, r22
	ret

/* EEPROM: cycles of the instructions that start a read and a write. */
fact ee_read
	lds	r18, TCNT1L
	sbi	EECR, EERE
	lds	r24, TCNT1L
	sub	r24, r18
	subi	r24, 2
	clr	r25
	ret

fact ee_write
	out	EEDR, r1
	lds	r18, TCNT1L
	sbi	EECR, EEMPE
	sbi	EECR, EEPE
	lds	r24, TCNT1L
	sub	r24, r18
	subi	r24, 2
	clr	r25
	ret

/* EEPE in the cycle `count + 2` after that of EEMPE; WDTCSR and CLKPR likewise behind their change enable. */
.macro window count
	.global	ee_\count, wd_\count, clk_\count
ee_\count:
	sbi	EECR, EEMPE
	nops	\count
	sbi	EECR, EEPE
	ret
wd_\count:
	ldi	r24, 1 << WDCE | 1 << WDE
	ldi	r22, 1 << WDP0
	sts	WDTCSR, r24
	nops	\count
	sts	WDTCSR, r22
	lds	r24, WDTCSR
	ret
clk_\count:
	ldi	r24, 1 << CLKPCE
	ldi	r22, 1
	sts	CLKPR, r24
	nops	\count
	sts	CLKPR, r22
	lds	r24, CLKPR
	ret
.endm
	window	0
	window	2
	window	3

/* SPIF r24 cycles after SPDR, at least two. */
	.global	spif_after
spif_after:
	ldi	r30, pm_lo8(1f)
	ldi	r31, pm_hi8(1f)
	subi	r24, 2
	sub	r30, r24
	sbc	r31, r1
	out	SPDR, r1
	ijmp
	nops	40
1:	in	r22, SPSR
	give	SPIF, r22

/* SPM from the application section: erases a page, then checks the page. */
fact spm
	ldi	r30, lo8(page)
	ldi	r31, hi8(page)
	ldi	r24, 1 << PGERS | 1 << SELFPRGEN
	out	SPMCSR, r24
	spm
	nops	8
	lpm	r24, Z
	clr	r25
	ret

.macro first_byte name, count
fact \name
	ldi	r30, 0
	ldi	r31, 0
	ldi	r24, 1 << SIGRD | 1 << SELFPRGEN
	out	SPMCSR, r24
	nops	\count
	lpm	r24, Z
	clr	r25
	ret
.endm
	first_byte signature, 0
	first_byte sig_late, 5

/* MCUCR after IVSEL in the cycle `count + 1` after that of IVCE. */
.macro vectors name, count
fact \name
	ldi	r24, 1 << IVCE
	ldi	r22, 1 << IVSEL
	out	MCUCR, r24
	nops	\count
	out	MCUCR, r22
	in	r25, MCUCR
	out	MCUCR, r24
	out	MCUCR, r1
	mov	r24, r25
	clr	r25
	ret
.endm
	vectors	iv_window_4, 3
	vectors	iv_window_5, 4

/* TCNT0, clk/64, across 1000 cycles with PRTIM0 set. */
fact prr
	rcall	run0
	ldi	r22, 3
	out	TCCR0B, r22
	ldi	r22, 1 << PRTIM0
	ldi	r24, 250
	ldi	r23, 1 << PSRSYNC
	out	GTCCR, r23
	in	r23, TCNT0
	sts	PRR, r22
1:	dec	r24
	nop
	brne	1b
	sts	PRR, r1
	in	r24, TCNT0
	out	TCCR0B, r1
	sub	r24, r23
	clr	r25
	ret

	.balign	128
page:	.fill	128, 1, 0x5A
