/*
 * What comes in over USART0 goes out again in capitals, both by interrupt with a ring of bytes between them; the chip
 * sleeps while there is nothing to do. Byte 04h (control D) ends it, with a count.
 *
 * Build: avr-gcc -mmcu=atmega328p -DF_CPU=16000000 -Os -o echo.elf echo.c
 */
#include "uart.h"

#include <ctype.h>
#include <stdint.h>

#define SIZE 64 /* a power of two */

static volatile char ring[SIZE];
static volatile uint8_t head, tail;
static volatile uint16_t bytes, bad;
static volatile uint8_t over;

ISR(USART_RX_vect)
{
	uint8_t wrong = UCSR0A & (_BV(FE0) | _BV(DOR0) | _BV(UPE0));
	char c = UDR0;
	if (wrong)
		bad++;
	if (c == 4) {
		over = 1;
		return;
	}
	bytes++;
	ring[head++ % SIZE] = toupper(c);
	UCSR0B |= _BV(UDRIE0);
}

ISR(USART_UDRE_vect)
{
	if (head == tail)
		UCSR0B &= ~_BV(UDRIE0);
	else
		UDR0 = ring[tail++ % SIZE];
}

int main(void)
{
	begin();
	UCSR0B |= _BV(RXEN0) | _BV(RXCIE0);
	set_sleep_mode(SLEEP_MODE_IDLE);
	for (;;) {
		cli();
		if (over && head == tail)
			break;
		sleep_enable();
		sei();
		sleep_cpu();
	}
	UCSR0B = _BV(TXEN0);
	printf("\n%u bytes, %u bad\n", bytes, bad);
	end();
}
