/*
 * A filter of an analog input: timer 1 starts a conversion of ADC0 every millisecond, the median of the last three goes
 * through a low pass of first order, and every eighth millisecond the input and the output are printed in millivolts of a 5 V supply.
 *
 * Build: avr-gcc -mmcu=atmega328p -DF_CPU=16000000 -Os -o filter.elf filter.c
 */
#include "uart.h"

#include <stdint.h>

/* The newest input and what the filter makes of it, in counts by 16, and how many inputs there were. */
static volatile uint16_t input, output;
static volatile uint8_t samples;

static uint16_t median(uint16_t a, uint16_t b, uint16_t c)
{
	if (a > b) {
		uint16_t t = a;
		a = b;
		b = t;
	}
	return c < a ? a : c > b ? b : c;
}

ISR(ADC_vect)
{
	static uint16_t last[2];
	uint16_t now = ADC;
	int16_t middle = median(last[0], last[1], now) * 16;

	last[0] = last[1];
	last[1] = now;
	input = now;
	output += (int16_t)(middle - (int16_t)output) / 8;
	samples++;
	TIFR1 = _BV(OCF1B); /* The next match is an edge again. */
}

static unsigned millivolts(uint16_t counts)
{
	return (uint32_t)counts * 5000 / 1024;
}

int main(void)
{
	begin();
	ADMUX = _BV(REFS0);
	DIDR0 = _BV(ADC0D);
	ADCSRB = _BV(ADTS2) | _BV(ADTS0); /* match B of timer 1 */
	ADCSRA = _BV(ADEN) | _BV(ADATE) | _BV(ADIE) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);
	OCR1A = F_CPU / 8 / 1000 - 1;
	OCR1B = OCR1A;
	TCCR1B = _BV(WGM12) | _BV(CS11);
	sei();
	for (uint8_t reported = 0; reported < 96;) {
		cli();
		uint8_t number = samples;
		uint16_t in = input, out = output / 16;
		sei();
		/* It does not sleep between: entering idle mode would start a conversion of its own. */
		if (number >= reported + 8) {
			reported = number;
			printf("%2u ms %4u %4u\n", number, millivolts(in), millivolts(out));
		}
	}
	end();
}
