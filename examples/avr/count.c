/*
 * Counts its starts in the EEPROM of the chip, and keeps a text beside it that the image brings along.
 *
 * Build: avr-gcc -mmcu=atmega328p -DF_CPU=16000000 -Os -o count.elf count.c
 */
#include "uart.h"

#include <avr/eeprom.h>
#include <stdint.h>

static uint16_t starts EEMEM = 0;
static char name[] EEMEM = "counter";

int main(void)
{
	char text[sizeof name];

	begin();
	uint16_t count = eeprom_read_word(&starts) + 1;
	eeprom_update_word(&starts, count);
	eeprom_read_block(text, name, sizeof text);
	printf("%s: start %u\n", text, count);
	end();
}
