/*
 * A sine of 1 kHz at OC2B (PD3): fast PWM of 62.5 kHz, whose duty is changed at every overflow by a table and a phase of 16 bits.
 * After 20 ms the tone ends and the number of steps is printed.
 *
 * Build: avr-gcc -mmcu=atmega328p -DF_CPU=16000000 -Os -o tone.elf tone.c
 */
#include "uart.h"

#include <avr/pgmspace.h>
#include <stdint.h>

/* 1000 Hz: 65536 * 1000 / 62500, rounded. */
#define STEP 1049

/* 128 + 120 sin(2 pi n / 32): never 255, of which there would be no edges */
static const uint8_t sine[32] PROGMEM = {
	128, 151, 174, 195, 213, 228, 239, 246, 248, 246, 239, 228, 213, 195, 174, 151,
	128, 105, 82, 61, 43, 28, 17, 10, 8, 10, 17, 28, 43, 61, 82, 105,
};

static volatile uint16_t steps;

ISR(TIMER2_OVF_vect)
{
	static uint16_t phase;
	OCR2B = pgm_read_byte(&sine[phase >> 11]);
	phase += STEP;
	steps++;
}

int main(void)
{
	begin();
	DDRD |= _BV(PD3);
	OCR2B = 128;
	TCCR2A = _BV(COM2B1) | _BV(WGM21) | _BV(WGM20);
	TIMSK2 = _BV(TOIE2);
	TCCR2B = _BV(CS20);
	sei();
	set_sleep_mode(SLEEP_MODE_IDLE);
	while (steps < 1250)
		sleep_mode();
	TCCR2A = 0;
	TIMSK2 = 0;
	printf("%u steps\n", steps);
	end();
}
