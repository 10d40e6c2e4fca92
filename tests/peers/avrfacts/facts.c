/*
 * Prints the cycle facts of the ATmega328P over USART0 (115200 baud 8N1 at 16 MHz), one line per fact: its name and its value.
 * facts.txt has the values of the data sheet. Every wait has a limit, so that a fault prints a wrong value.
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
	PAUSE(5000); /* both bytes are sent */
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

/* PD1, an input without pull-up as a port, while the transmitter is on. */
FACT(txd_over)
{
	DDRD &= ~2;
	PORTD &= ~2;
	PAUSE(4);
	return BIT(PIND, 1);
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

/* Is a cell written if the start comes this late? */
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

/* Milliseconds that timer 1 counts while the core sleeps for the watchdog's time. */
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

/*
 * From waking by the watchdog to its next interrupt, in idle, in cycles modulo 65536. Timer 0 ends it after 16.4 ms if the
 * watchdog interrupt does not repeat.
 */
static uint16_t rest(uint8_t mode)
{
	wdt_reset();
	WDTCSR = 1 << WDCE | 1 << WDE;
	WDTCSR = 1 << WDIE;
	SMCR = mode | 1 << SE;
	sei();
	sleep_cpu();
	stopwatch(1);
	TCCR0B = 5;
	TCNT0 = 0;
	OCR0A = 255;
	TIFR0 = 7;
	TIMSK0 = 1 << OCIE0A;
	SMCR = 1 << SE;
	sleep_cpu();
	cli();
	SMCR = 0;
	TIMSK0 = 0;
	TCCR0B = 0;
	wdt_disable();
	return wd_at;
}

/* The later it wakes, the shorter the remaining time. */
FACT(wake_down)
{
	uint16_t idle = rest(0);
	return idle - rest(1 << SM1);
}

FACT(wake_standby)
{
	uint16_t idle = rest(0);
	return idle - rest(1 << SM2 | 1 << SM1);
}

/* WDIE after the first time-out with WDE and WDIE. */
FACT(wdt_both)
{
	wdt_reset();
	WDTCSR = 1 << WDCE | 1 << WDE;
	WDTCSR = 1 << WDIE | 1 << WDE;
	wd_count = 0;
	stopwatch(5);
	sei();
	while (TCNT1 < 400 && !wd_count)
		;
	cli();
	uint8_t wdtcsr = WDTCSR;
	wdt_disable();
	stopwatch(1);
	return BIT(wdtcsr, WDIE);
}

static void full_clock(void)
{
	CLKPR = 1 << CLKPCE;
	CLKPR = 0;
}

/* The watchdog's time measured with a clock of half the speed. */
FACT(wdt_clock)
{
	clk_0();
	uint16_t ms = f_wdt();
	full_clock();
	return ms;
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
		say(PSTR("wdt_irqs"), wd_count);
		say(PSTR("wdt_resets"), BIT(mcusr, WDRF));
		say(PSTR("wdrf_wde"), BIT(wdtcsr, WDE));
	} else {
		say(PSTR("por"), BIT(mcusr, PORF));
		print_all();
		wd_count = 0;
		wdt_reset();
		WDTCSR = 1 << WDCE | 1 << WDE;
		WDTCSR = 1 << WDIE | 1 << WDE;
		sei();
		PAUSE(1600000);
		wdt_disable();
	}
	cli();
	sleep_enable();
	for (;;)
		sleep_cpu();
}
