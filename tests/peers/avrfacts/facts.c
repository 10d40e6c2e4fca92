/*
 * Prints the cycle facts of the ATmega328P over USART0 (115200 baud 8N1 at 16 MHz), a line a fact: its name and its figure.
 * What the data sheet says of each stands in facts.txt. Every wait has an end, so that a fault prints a wrong figure.
 */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#include "facts.h"

static void put(char c)
{
	for (uint16_t i = 0; i < 5000 && !BIT(UCSR0A, UDRE0); i++)
		;
	UDR0 = c;
}

static void say(const char *name, uint16_t figure)
{
	char digits[5];
	uint8_t n = 0;
	char c;
	while ((c = pgm_read_byte(name++)))
		put(c);
	put(' ');
	do
		digits[n++] = '0' + figure % 10;
	while (figure /= 10);
	while (n)
		put(digits[--n]);
	put('\n');
	PAUSE(5000); /* both bytes are out */
}

FACT(sleep)
{
	uint16_t there = awake();
	return asleep() - there;
}

/* Pins */

FACT(pull_up)
{
	DDRC &= ~1;
	PORTC |= 1;
	PAUSE(4);
	uint8_t pins = PINC;
	PORTC &= ~1;
	return pins & 1;
}

FACT(int0_own)
{
	PORTD &= ~4;
	DDRD |= 4;
	EICRA = 3;
	PAUSE(8);
	EIFR = 3;
	PORTD |= 4;
	PAUSE(8);
	uint8_t flags = EIFR;
	EIFR = 3;
	EICRA = 0;
	return BIT(flags, INTF0);
}

FACT(pcint_own)
{
	PORTD &= ~4;
	DDRD |= 4;
	PCMSK2 = 4;
	PAUSE(8);
	PCIFR = 7;
	PORTD |= 4;
	PAUSE(8);
	uint8_t flags = PCIFR;
	PCMSK2 = 0;
	PCIFR = 7;
	DDRD &= ~4;
	PORTD &= ~4;
	return BIT(flags, PCIF2);
}

/* EEPROM */

static void ee_wait(void)
{
	for (uint32_t i = 0; i < 200000 && BIT(EECR, EEPE); i++)
		;
}

/* Is a cell written by a start that comes so late? */
static uint8_t ee_starts(void (*start)(void))
{
	ee_wait();
	EECR = 0;
	EEAR = 3;
	EEDR = 0x11;
	ee_0();
	ee_wait();
	EEDR = 0x22;
	start();
	PAUSE(10);
	ee_wait();
	EECR |= 1 << EERE;
	uint8_t cell = EEDR;
	return cell == 0x22;
}

FACT(ee_window_4)
{
	return ee_starts(ee_2);
}

FACT(ee_window_5)
{
	return ee_starts(ee_3);
}

/* Tenths of a millisecond. */
static uint16_t ee_time(uint8_t mode)
{
	ee_wait();
	EECR = mode;
	EEAR = 4;
	EEDR = 0;
	stopwatch(3);
	ee_0();
	ee_wait();
	uint16_t ticks = TCNT1;
	stopwatch(1);
	EECR = 0;
	return (ticks + 12) / 25;
}

FACT(ee_both)
{
	return ee_time(0);
}

FACT(ee_erase)
{
	return ee_time(1 << EEPM0);
}

FACT(ee_only)
{
	return ee_time(1 << EEPM1);
}

/* Watchdog and clock */

/* Milliseconds to the interrupt. */
FACT(wdt)
{
	wdt_reset();
	WDTCSR = 1 << WDCE | 1 << WDE;
	WDTCSR = 1 << WDIE;
	stopwatch(5);
	while (TCNT1 < 2000 && !BIT(WDTCSR, WDIF))
		;
	uint16_t ticks = TCNT1;
	wdt_disable();
	WDTCSR |= 1 << WDIF;
	stopwatch(1);
	return (ticks * 8 + 62) / 125;
}

FACT(wd_window_4)
{
	uint8_t wdtcsr = wd_2();
	wdt_disable();
	return wdtcsr;
}

FACT(wd_window_5)
{
	uint8_t wdtcsr = wd_3();
	wdt_disable();
	return wdtcsr;
}

/* Milliseconds that timer 1 counts while the core sleeps through the watchdog's time. */
static uint16_t nap(uint8_t mode)
{
	wdt_reset();
	WDTCSR = 1 << WDCE | 1 << WDE;
	WDTCSR = 1 << WDIE;
	SMCR = mode | 1 << SE;
	stopwatch(5);
	sei();
	sleep_cpu();
	cli();
	uint16_t ticks = TCNT1;
	SMCR = 0;
	wdt_disable();
	stopwatch(1);
	return (ticks * 8 + 62) / 125;
}

FACT(idle)
{
	return nap(0);
}

FACT(power_down)
{
	return nap(1 << SM1);
}

static void full_clock(void)
{
	CLKPR = 1 << CLKPCE;
	CLKPR = 0;
}

FACT(clkpr)
{
	uint8_t found = clk_0();
	full_clock();
	return found;
}

FACT(clkpr_alone)
{
	CLKPR = 1;
	uint8_t found = CLKPR;
	full_clock();
	return found;
}

FACT(clk_window_4)
{
	uint8_t found = clk_2();
	full_clock();
	return found;
}

FACT(clk_window_5)
{
	uint8_t found = clk_3();
	full_clock();
	return found & 0x7F;
}

/* USART: what is sent here are blanks before the name of the fact. */

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

/* Converter: clock/128; conversions are counted in its clocks. */

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

static void print_all(void)
{
#define PRINT(name) stopwatch(1); say(PSTR(#name), f_##name());
	FACTS(PRINT)
}

int main(void)
{
	uint8_t wdtcsr = WDTCSR, mcusr = MCUSR;
	MCUSR = 0;
	wdt_disable();
	UBRR0 = 8;
	UCSR0C = 1 << UCSZ01 | 1 << UCSZ00;
	UCSR0B = 1 << TXEN0;
	GPIOR0 = 0;

	if (BIT(mcusr, WDRF)) {
		say(PSTR("wdt_resets"), BIT(mcusr, WDRF));
		say(PSTR("wdrf_wde"), BIT(wdtcsr, WDE));
	} else {
		print_all();
		wdt_enable(WDTO_15MS);
		PAUSE(1600000);
		wdt_disable();
	}
	cli();
	sleep_enable();
	for (;;)
		sleep_cpu();
}
