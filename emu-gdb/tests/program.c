/* What avr-gdb is tried on. Built by tests/avr_gdb.rs: avr-gcc -mmcu=atmega328p -Og -g */
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <stdint.h>

const char greeting[] PROGMEM = "hello";
uint8_t kept EEMEM = 7;
volatile uint16_t total;
volatile uint8_t ticks;
uint8_t table[4] = { 1, 2, 3, 4 };

ISR(TIMER0_OVF_vect)
{
	ticks++;
}

static uint16_t __attribute__((noinline)) square(uint8_t n)
{
	uint16_t result = n;
	result *= n;
	return result;
}

static void __attribute__((noinline)) add(uint8_t n)
{
	uint16_t part = square(n);
	total += part;
}

int main(void)
{
	TIMSK0 = 1 << TOIE0;
	TCCR0B = 1 << CS00;
	sei();
	for (uint8_t i = 0; i < 4; i++)
		add(table[i]);
	while (ticks < 3)
		;
	cli();
	for (;;)
		;
}
