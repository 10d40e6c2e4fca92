/* Prints over USART0 in the ways that programs do: polled, by printf with a stream, and from the data-empty interrupt. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <stdio.h>

static int put(char c, FILE *stream)
{
	(void)stream;
	loop_until_bit_is_set(UCSR0A, UDRE0);
	UDR0 = c;
	return 0;
}

static FILE out = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);

static const char farewell[] PROGMEM = "sent by interrupt\n";
static volatile uint8_t next;

ISR(USART_UDRE_vect)
{
	char c = pgm_read_byte(&farewell[next]);
	if (c) {
		UDR0 = c;
		next++;
	} else {
		UCSR0B &= ~_BV(UDRIE0);
	}
}

static uint32_t crc32(uint32_t crc, uint8_t byte)
{
	crc ^= byte;
	for (uint8_t i = 0; i < 8; i++)
		crc = crc & 1 ? crc >> 1 ^ 0xEDB88320 : crc >> 1;
	return crc;
}

int main(void)
{
	uint32_t crc = 0xFFFFFFFF;

	UBRR0 = 8; /* 115200 baud at 16 MHz */
	UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
	UCSR0B = _BV(TXEN0);
	stdout = &out;

	printf("hello, world\n");
	for (uint16_t i = 0; i < 1000; i++)
		crc = crc32(crc, i * 7);
	printf("crc %08lx\n", ~crc);
	for (int i = -3; i <= 3; i++)
		printf("%d*%d=%ld %d/3=%d\n", i, i * 1001, (long)i * i * 1001, i * 100, i * 100 / 3);
	for (int i = 0; i < 256; i++)
		put(i, stdout);

	sei();
	UCSR0B |= _BV(UDRIE0);
	while (UCSR0B & _BV(UDRIE0))
		;
	while (!(UCSR0A & _BV(UDRE0)))
		;
	printf("done\n");
	cli();
	sleep_enable();
	for (;;)
		sleep_cpu();
}
