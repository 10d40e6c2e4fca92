/* Facts of the serial interfaces and of the converter. */
#include <avr/interrupt.h>
#include <avr/io.h>

#include "facts.h"

/* USART: the bytes sent here are blanks before the name of the fact. */

FACT(udre_first)
{
	UDR0 = ' ';
	PAUSE(300);
	return BIT(UCSR0A, UDRE0);
}

FACT(udre_second)
{
	UDR0 = ' ';
	PAUSE(300);
	UDR0 = ' ';
	PAUSE(8);
	uint8_t ucsra = UCSR0A;
	PAUSE(5000);
	return BIT(ucsra, UDRE0);
}

/* Whole bits from the write of UDR0 to TXC. */
FACT(frame)
{
	UCSR0A |= 1 << TXC0;
	UDR0 = ' ';
	stopwatch(1);
	while (TCNT1 < 20000 && !BIT(UCSR0A, TXC0))
		;
	return TCNT1 / 144;
}

/* TXC after the first of two bytes. */
FACT(txc_early)
{
	UCSR0A |= 1 << TXC0;
	UDR0 = ' ';
	PAUSE(300);
	UDR0 = ' ';
	PAUSE(2000);
	uint8_t ucsra = UCSR0A;
	PAUSE(5000);
	return BIT(ucsra, TXC0);
}

/* The receiver. A wire leads from TXD to RXD; with the transmitter off, PD1 belongs to the port and generates the frames. */

/* Waits for a byte, two frames at most. */
static uint8_t received(void)
{
	stopwatch(1);
	while (TCNT1 < 3400 && !BIT(UCSR0A, RXC0))
		;
	return BIT(UCSR0A, RXC0);
}

/* Enables only the transmitter. */
static void deaf(void)
{
	UCSR0A = 0;
	UCSR0B = 1 << TXEN0;
	UCSR0C = 1 << UCSZ01 | 1 << UCSZ00;
	DDRD &= ~2;
}

static const char blanks[] = { ' ', '\t', '\r', ' ' };

/* Sends a number of bytes and reads none. */
static void unread(uint8_t count)
{
	UCSR0B = 1 << RXEN0 | 1 << TXEN0;
	for (uint8_t i = 0; i < count; i++) {
		UDR0 = blanks[i];
		PAUSE(2000);
	}
}

FACT(rx_byte)
{
	unread(1);
	uint8_t byte = received() ? UDR0 : 0;
	deaf();
	return byte;
}

/* The number of bytes received out of three. */
FACT(rx_three)
{
	uint8_t right = 0;
	unread(3);
	for (uint8_t i = 0; i < 3 && received(); i++)
		right += (uint8_t)UDR0 == (uint8_t)blanks[i];
	deaf();
	return right;
}

FACT(rx_dor)
{
	uint8_t lost = 0;
	unread(4);
	while (received()) {
		lost |= BIT(UCSR0A, DOR0);
		(void)UDR0;
	}
	deaf();
	return lost;
}

/* PD1 follows the bits, 144 cycles each. */
static void bits(uint16_t pattern, uint8_t count)
{
	while (count--) {
		if (pattern & 1)
			PORTD |= 2;
		else
			PORTD &= ~2;
		pattern >>= 1;
		PAUSE(131);
	}
}

/* The receiver listens to PD1. */
static void listen(void)
{
	PORTD |= 2;
	DDRD |= 2;
	UCSR0B = 1 << RXEN0;
	PAUSE(400);
}

/* A flag of UCSR0A with the first byte (2) and with the second (1), with the given frames. */
static uint8_t flags(uint16_t first, uint16_t second, uint8_t count, uint8_t flag)
{
	bits(first, count);
	bits(3, 2);
	bits(second, count);
	bits(3, 2);
	uint8_t seen = received() ? BIT(UCSR0A, flag) << 1 : 4;
	(void)UDR0;
	seen |= received() ? BIT(UCSR0A, flag) : 8;
	deaf();
	return seen;
}

FACT(rx_fe)
{
	listen();
	return flags(0x20 << 1, 0x20 << 1 | 0x200, 10, FE0);
}

FACT(rx_upe)
{
	UCSR0C = 1 << UPM01 | 1 << UCSZ01 | 1 << UCSZ00;
	listen();
	return flags(0x20 << 1 | 0x400, 0x20 << 1 | 0x600, 11, UPE0);
}

/* Halves of a bit from the start bit to RXC. */
FACT(rx_time)
{
	listen();
	TCNT1 = 0;
	bits(0x20 << 1, 9);
	PORTD |= 2;
	while (TCNT1 < 5000 && !BIT(UCSR0A, RXC0))
		;
	uint16_t cycles = TCNT1;
	deaf();
	return cycles / 72;
}

/* Low for a quarter of a bit. */
FACT(rx_glitch)
{
	listen();
	PORTD &= ~2;
	PAUSE(36);
	PORTD |= 2;
	uint8_t heard = received();
	deaf();
	return heard;
}

/* Nine bits and MPCM: is a frame of data received (2), and one with an address (1)? */
FACT(rx_mpcm)
{
	listen();
	UCSR0B = 1 << RXEN0 | 1 << UCSZ02;
	UCSR0A = 1 << MPCM0;
	bits(0x20 << 1 | 0x400, 11);
	uint8_t heard = received() << 1;
	(void)UDR0;
	bits(0x20 << 1 | 0x600, 11);
	heard |= received();
	deaf();
	return heard;
}

/* SPI master at half the clock: cycles from the write of SPDR to SPIF. */
FACT(spi)
{
	uint16_t cycles = 2;
	DDRB |= 4; /* SS is an output */
	SPCR = 1 << SPE | 1 << MSTR;
	SPSR = 1 << SPI2X;
	while (cycles < 40 && !spif_after(cycles)) {
		stopwatch(1);
		while (TCNT1 < 20000 && !BIT(SPSR, SPIF))
			;
		(void)SPDR;
		cycles++;
	}
	if (cycles == 40) {
		stopwatch(1);
		SPDR = 0;
		while (TCNT1 < 20000 && !BIT(SPSR, SPIF))
			;
		cycles = TCNT1;
	}
	SPSR = 0;
	SPCR = 0;
	DDRB &= ~4;
	return cycles;
}

/* Converter: clock/128; conversions are measured in its clocks. */

static uint16_t conversion(void)
{
	stopwatch(1);
	ADCSRA |= 1 << ADSC;
	while (TCNT1 < 30000 && BIT(ADCSRA, ADSC))
		;
	return TCNT1 / 128;
}

static void converter(uint8_t admux)
{
	ADCSRA = 0;
	ADMUX = admux;
	ADCSRA = 1 << ADEN | 7;
	PAUSE(80);
}

FACT(adc_first)
{
	converter(1 << REFS0 | 15);
	uint16_t clocks = conversion();
	ADCSRA = 0;
	return clocks;
}

FACT(adc_next)
{
	converter(1 << REFS0 | 15);
	conversion();
	PAUSE(48);
	uint16_t clocks = conversion();
	ADCSRA = 0;
	return clocks;
}

/* The band gap is converted, ADCL read, and ground converted: does ADCH still belong to the first? */
FACT(adc_lock)
{
	converter(1 << REFS0 | 1 << ADLAR | 14);
	conversion();
	conversion();
	uint8_t low = ADCL;
	ADMUX = 1 << REFS0 | 1 << ADLAR | 15;
	conversion();
	uint8_t high = ADCH;
	(void)low;
	ADCSRA = 0;
	return high != 0;
}

/* A trigger by OCF1B at 5000; halves of the converter's clocks from there to ADIF. */
FACT(adc_trigger)
{
	converter(1 << REFS0 | 15);
	conversion();
	stopwatch(1);
	OCR1B = 5000;
	TIFR1 = 0x27;
	ADCSRB = 1 << ADTS2 | 1 << ADTS0;
	ADCSRA |= 1 << ADIF | 1 << ADATE;
	while (TCNT1 < 30000 && !BIT(ADCSRA, ADIF))
		;
	uint16_t cycles = TCNT1 - 5000;
	ADCSRA = 0;
	ADCSRB = 0;
	stopwatch(1);
	return cycles / 64;
}

/* ADATE while the trigger flag is already set: does a conversion start? */
FACT(adc_edge)
{
	converter(1 << REFS0 | 15);
	conversion();
	stopwatch(1);
	OCR1B = 50;
	PAUSE(300);
	ADCSRB = 1 << ADTS2 | 1 << ADTS0;
	ADCSRA |= 1 << ADIF | 1 << ADATE;
	PAUSE(6000);
	uint8_t adif = BIT(ADCSRA, ADIF);
	ADCSRA = 0;
	ADCSRB = 0;
	stopwatch(1);
	return adif;
}

/* Clocks of the converter from one result to the next, free running. */
FACT(adc_free)
{
	converter(1 << REFS0 | 15);
	ADCSRB = 0;
	ADCSRA |= 1 << ADATE | 1 << ADSC;
	uint16_t clocks = 0;
	for (uint8_t i = 0; i < 3; i++) {
		stopwatch(1);
		while (TCNT1 < 30000 && !BIT(ADCSRA, ADIF))
			;
		clocks = (TCNT1 + 64) / 128;
		ADCSRA |= 1 << ADIF;
	}
	ADCSRA = 0;
	return clocks;
}

/* The band gap is converted, and ground selected during the conversion: is the result that of the band gap? */
FACT(adc_mux)
{
	converter(1 << REFS0 | 14);
	conversion();
	ADCSRA |= 1 << ADSC;
	PAUSE(700);
	ADMUX = 1 << REFS0 | 15;
	PAUSE(2000);
	uint16_t result = ADC;
	ADCSRA = 0;
	return result > 100;
}

/* The same result with ADLAR, divided by the one without. */
FACT(adlar)
{
	converter(1 << REFS0 | 14);
	conversion();
	conversion();
	uint16_t plain = ADC;
	ADMUX |= 1 << ADLAR;
	uint16_t left = ADC;
	ADCSRA = 0;
	return plain ? left / plain : 0;
}

/* ADC0 is driven high for a number of cycles from the start, and then low: is the result high? */
static inline __attribute__((always_inline)) uint8_t sampled(uint8_t start, uint16_t cycles)
{
	PORTC |= 1;
	DDRC |= 1;
	PAUSE(8);
	ADCSRA = start;
	PAUSE(cycles);
	PORTC &= ~1;
	PAUSE(4000);
	DDRC &= ~1;
	return ADC > 500;
}

/* The first conversion samples after 13.5 clocks, others after 1.5, and each begins within a clock. */
FACT(adc_sample)
{
	const uint8_t on = 1 << ADEN | 7, start = on | 1 << ADSC;
	ADCSRA = 0;
	ADMUX = 1 << REFS0;
	uint8_t seen = sampled(start, 13 * 128);
	ADCSRA = 0;
	seen |= sampled(start, 15 * 128) << 1;
	seen |= sampled(start, 128) << 2;
	seen |= sampled(start, 3 * 128) << 3;
	ADCSRA = 0;
	return seen;
}
