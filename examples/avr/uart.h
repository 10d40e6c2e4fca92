/*
 * What the programs have in common: USART0 as standard output, 38400 baud, 8 bits, no parity, and an end.
 *
 * Built with -DSINK a program writes its bytes to GPIOR0 instead, always by OUT, which takes one cycle, so that the cycle of each
 * byte depends on the program alone.
 */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdio.h>

#define BAUD 38400
#include <util/setbaud.h>

static int put(char c, FILE *stream)
{
	(void)stream;
#ifdef SINK
	__asm__ volatile("out %0, %1" ::"I"(_SFR_IO_ADDR(GPIOR0)), "r"(c));
#else
	loop_until_bit_is_set(UCSR0A, UDRE0);
	UDR0 = c;
#endif
	return 0;
}

static FILE uart = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);

static inline void begin(void)
{
	UBRR0 = UBRR_VALUE;
	UCSR0A = USE_2X ? _BV(U2X0) : 0;
	UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
	UCSR0B |= _BV(TXEN0);
	stdout = &uart;
}

/* Sleeps until an interrupt, then again. In idle mode the USART still sends what it holds. */
static inline void end(void)
{
	cli();
	set_sleep_mode(SLEEP_MODE_IDLE);
	sleep_enable();
	for (;;)
		sleep_cpu();
}
