/*
 * A clock in milliseconds: timer 0 interrupts a thousand times a second. The lamp at PB5 toggles every 100 ms, and each toggle is
 * printed. Between the interrupts the chip sleeps.
 *
 * Build: avr-gcc -mmcu=atmega328p -DF_CPU=16000000 -Os -o millis.elf millis.c
 */
#include "uart.h"

#include <util/atomic.h>

static volatile uint32_t ticks;

ISR(TIMER0_COMPA_vect)
{
	ticks++;
}

static uint32_t millis(void)
{
	uint32_t now;
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		now = ticks;
	}
	return now;
}

int main(void)
{
	begin();
	DDRB |= _BV(PB5);
	TCCR0A = _BV(WGM01);
	OCR0A = F_CPU / 64 / 1000 - 1;
	TIMSK0 = _BV(OCIE0A);
	TCCR0B = _BV(CS01) | _BV(CS00);
	sei();

	uint32_t last = 0;
	set_sleep_mode(SLEEP_MODE_IDLE);
	while (last < 1000) {
		sleep_mode();
		if (millis() - last >= 100) {
			last += 100;
			PINB = _BV(PB5);
			printf("%lu ms\n", last);
		}
	}
	end();
}
