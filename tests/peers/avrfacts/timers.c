/* Facts of the timers. */
#include "facts.h"

static void stop0(void)
{
	TCCR0B = 0;
	TCCR0A = 0;
	TCNT0 = 0;
	TIFR0 = 7;
}

/* The flags of timer 0 after some time in a mode with a top of 50. */
static uint8_t flags0(uint8_t a, uint8_t b)
{
	stop0();
	OCR0A = 50;
	OCR0B = 20;
	TCCR0A = a;
	TCCR0B = b | 1;
	TCNT0 = 10;
	TIFR0 = 7;
	PAUSE(60);
	uint8_t early = TIFR0;
	PAUSE(100);
	uint8_t late = TIFR0;
	stop0();
	return BIT(early, TOV0) << 1 | BIT(late, TOV0);
}

FACT(match)
{
	for (uint8_t nops = 2; nops < 40; nops++)
		if (match_after(nops))
			return nops;
	return 0;
}

/* TOV0, OCF0A and OCF0B are set, and timer 0 is stopped. */
static void all_flags(void)
{
	stop0();
	OCR0A = 250;
	OCR0B = 20;
	TCCR0B = 1;
	TCNT0 = 10;
	PAUSE(300);
	TCCR0B = 0;
}

FACT(flag_all)
{
	all_flags();
	TIFR0 = 7;
	return TIFR0;
}

FACT(flag_out)
{
	all_flags();
	TIFR0 = 1 << OCF0A;
	return TIFR0;
}

FACT(flag_sbi)
{
	all_flags();
	TIFR0 |= 1 << OCF0A; /* SBI */
	return TIFR0;
}

FACT(tov_ctc)
{
	return flags0(1 << WGM01, 0);
}

FACT(tov_top)
{
	return flags0(1 << WGM01 | 1 << WGM00, 1 << WGM02);
}

FACT(tov_bottom)
{
	return flags0(1 << WGM00, 1 << WGM02);
}

/* OCR1A is written at about TCNT1 = 50; which of 100 and 500 matches, also in the second period of 1001 cycles? */
static uint8_t periods(uint8_t a, uint8_t b)
{
	uint8_t seen = 0;
	stopwatch(1 << WGM13 | 1 << WGM12 | 1);
	ICR1 = 1000;
	stopwatch(1);
	OCR1A = 100;
	TCCR1A = a;
	TCCR1B = b | 1;
	TCNT1 = 0;
	TIFR1 = 0x27;
	PAUSE(40);
	OCR1A = 500;
	PAUSE(150);
	seen |= BIT(TIFR1, OCF1A);
	TIFR1 = 1 << OCF1A;
	PAUSE(500);
	seen |= BIT(TIFR1, OCF1A) << 1;
	TIFR1 = 1 << OCF1A;
	PAUSE(500);
	seen |= BIT(TIFR1, OCF1A) << 2;
	TIFR1 = 1 << OCF1A;
	PAUSE(500);
	seen |= BIT(TIFR1, OCF1A) << 3;
	stopwatch(1);
	return seen;
}

FACT(ocr_normal)
{
	return periods(0, 0) & 3;
}

FACT(ocr_held)
{
	return periods(1 << WGM11, 1 << WGM13 | 1 << WGM12) & 3;
}

FACT(ocr_taken)
{
	return periods(1 << WGM11, 1 << WGM13 | 1 << WGM12) >> 2;
}

/*
 * Two slopes, 500 up and 500 down at clk/8. OCR1A goes from 100 to 300 at 50: matches seen up to 200 (1) and to 400 (2) on the
 * way up, to 250 (4) and to 50 (8) on the way down.
 */
static uint8_t slopes(uint8_t a, uint8_t b)
{
	uint8_t seen = 0;
	stopwatch(1 << WGM13 | 1 << WGM12 | 1);
	ICR1 = 500;
	stopwatch(2);
	OCR1A = 100;
	TCCR1A = a;
	TCCR1B = b | 2;
	TCNT1 = 0;
	TIFR1 = 0x27;
	PAUSE(400);
	OCR1A = 300;
	PAUSE(1200);
	for (uint8_t i = 0; i < 4; i++) {
		seen |= BIT(TIFR1, OCF1A) << i;
		TIFR1 = 1 << OCF1A;
		if (i == 1)
			PAUSE(2800 - 1600);
		PAUSE(1600);
	}
	stopwatch(1);
	return seen;
}

FACT(ocr_top)
{
	return slopes(1 << WGM11, 1 << WGM13);
}

FACT(ocr_bottom)
{
	return slopes(0, 1 << WGM13);
}

FACT(icr_normal)
{
	stopwatch(1 << WGM13 | 1 << WGM12 | 1);
	ICR1 = 0x101;
	stopwatch(1);
	ICR1 = 0x222;
	uint16_t icr = ICR1;
	stopwatch(1);
	return icr;
}

FACT(t0_pin)
{
	stop0();
	DDRD |= 0x10;
	PORTD &= ~0x10;
	TCCR0B = 7;
	PAUSE(10);
	TCNT0 = 0;
	for (uint8_t i = 0; i < 3; i++) {
		PORTD |= 0x10;
		PAUSE(10);
		PORTD &= ~0x10;
		PAUSE(10);
	}
	uint8_t count = TCNT0;
	stop0();
	DDRD &= ~0x10;
	return count;
}

FACT(t1_pin)
{
	DDRD |= 0x20;
	PORTD &= ~0x20;
	stopwatch(7);
	PAUSE(10);
	uint16_t before = TCNT1;
	for (uint8_t i = 0; i < 3; i++) {
		PORTD |= 0x20;
		PAUSE(10);
		PORTD &= ~0x20;
		PAUSE(10);
	}
	uint16_t count = TCNT1;
	stopwatch(1);
	DDRD &= ~0x20;
	return count - before;
}

FACT(icp_noise)
{
	uint16_t plain = capture(1 << ICES1 | 1);
	return capture(1 << ICNC1 | 1 << ICES1 | 1) - plain;
}

/* OC0A, initially set, after a forced match. */
static uint8_t forced(uint8_t a)
{
	stop0();
	OCR0A = 100;
	DDRD |= 0x40;
	TCCR0A = 1 << COM0A1 | 1 << COM0A0;
	TCCR0B = 1 << FOC0A;
	TCCR0A = a;
	TCCR0B = 1 << FOC0A;
	PAUSE(4);
	uint8_t pins = PIND;
	stop0();
	DDRD &= ~0x40;
	return BIT(pins, 6);
}

FACT(foc)
{
	return forced(1 << COM0A1);
}

FACT(foc_pwm)
{
	return forced(1 << COM0A1 | 1 << WGM01 | 1 << WGM00);
}

/* Fast PWM on OC0A: does the pin move? */
static uint8_t moves(uint8_t ocr)
{
	stop0();
	OCR0A = ocr;
	DDRD |= 0x40;
	TCCR0A = 1 << COM0A1 | 1 << WGM01 | 1 << WGM00;
	TCCR0B = 2;
	PCMSK2 = 0x40;
	PAUSE(4000);
	PCIFR = 7;
	PAUSE(4200);
	uint8_t flags = PCIFR;
	PCMSK2 = 0;
	stop0();
	DDRD &= ~0x40;
	PCIFR = 7;
	return BIT(flags, PCIF2);
}

FACT(pwm_max)
{
	return moves(255);
}

FACT(pwm_bottom)
{
	return moves(0);
}

FACT(as2_busy)
{
	ASSR = 1 << AS2;
	TCNT2 = 5;
	uint8_t busy = ASSR;
	ASSR = 0;
	TCNT2 = 0;
	return BIT(busy, TCN2UB);
}

/* 64 ticks of the crystal of 32.768 kHz, in units of 250 cycles. */
FACT(as2_rate)
{
	ASSR = 1 << AS2;
	TCCR2A = 0;
	TCCR2B = 1;
	stopwatch(1);
	while (TCNT1 < 20000 && BIT(ASSR, TCR2BUB))
		;
	uint8_t before = TCNT2;
	while (TCNT1 < 30000 && TCNT2 == before)
		;
	before = TCNT2;
	stopwatch(1);
	while (TCNT1 < 60000 && (uint8_t)(TCNT2 - before) < 64)
		;
	uint16_t cycles = TCNT1;
	TCCR2B = 0;
	ASSR = 0;
	stopwatch(1);
	return (cycles + 125) / 250;
}
