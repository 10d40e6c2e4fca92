/*
 * Sleeps in power-down and is woken, by the watchdog's interrupt or by a button at INT0 (PD2, low when pressed); says which. The third
 * press ends it. Timer 1 counts how long the chip was awake, since it stands while the chip sleeps.
 *
 * Build: avr-gcc -mmcu=atmega328p -DF_CPU=16000000 -Os -o nap.elf nap.c
 */
#include "uart.h"

#include <avr/wdt.h>
#include <stdint.h>

static volatile uint8_t ticks, presses;

ISR(WDT_vect)
{
	ticks++;
}

/* A level goes on asking as long as it is there: the main program allows it again when the button is up. */
ISR(INT0_vect)
{
	presses++;
	EIMSK = 0;
}

/* Every 64 ms an interrupt, no reset. */
static void ticking(void)
{
	cli();
	wdt_reset();
	/* The second within four cycles of the first, whatever the options of the compiler are. */
	__asm__ volatile("sts %0, %1\n\tsts %0, %2" ::"n"(_SFR_MEM_ADDR(WDTCSR)), "r"((uint8_t)(_BV(WDCE) | _BV(WDE))),
			 "r"((uint8_t)(_BV(WDIE) | _BV(WDP1))));
	sei();
}

static void sent(void)
{
	loop_until_bit_is_set(UCSR0A, TXC0);
	UCSR0A |= _BV(TXC0);
}

int main(void)
{
	uint8_t reported = 0;

	begin();
	PORTD |= _BV(PD2);
	TCCR1B = _BV(CS12); /* by 256: 16 us */
	ticking();
	set_sleep_mode(SLEEP_MODE_PWR_DOWN);
	while (presses < 3) {
		cli();
		if (bit_is_set(PIND, PD2))
			EIMSK = _BV(INT0);
		sleep_enable();
		sei();
		sleep_cpu();
		sleep_disable();
		if (presses != reported) {
			reported = presses;
			printf("press %u after %u ticks\n", reported, ticks);
			sent();
		}
	}
	wdt_disable();
	printf("awake for %u ms\n", (unsigned)(TCNT1 / 62.5));
	end();
}
