/*
 * Hangs on purpose, and the watchdog resets it: each start tells its causes and how many starts there were since power came. The
 * third time the watchdog warns first, by its interrupt, and the reset comes with the next period.
 *
 * Build: avr-gcc -mmcu=atmega328p -DF_CPU=16000000 -Os -o watchdog.elf watchdog.c
 */
#include "uart.h"

#include <avr/wdt.h>
#include <stdint.h>

/* Kept by a reset, so the start-up code must not clear it; valid only if power was there. */
static uint8_t starts __attribute__((section(".noinit")));
static uint8_t causes __attribute__((section(".noinit")));

/* Before main: the watchdog goes on with its shortest period after it has reset the chip. */
static void __attribute__((naked, used, section(".init3"))) early(void)
{
	causes = MCUSR;
	MCUSR = 0;
	wdt_disable();
}

ISR(WDT_vect)
{
	printf("warned\n");
}

int main(void)
{
	begin();
	if (causes & _BV(PORF))
		starts = 0;
	starts++;
	printf("start %u:%s%s%s%s\n", starts, causes & _BV(PORF) ? " power" : "", causes & _BV(EXTRF) ? " pin" : "",
	       causes & _BV(BORF) ? " supply" : "", causes & _BV(WDRF) ? " watchdog" : "");
	if (starts == 4)
		end();
	wdt_enable(WDTO_15MS);
	if (starts == 3) {
		WDTCSR |= _BV(WDIE);
		sei();
	}
	for (;;)
		;
}
