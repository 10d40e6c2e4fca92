/*
 * A log in a 24C64 on the two-wire bus at 100 kHz: the first word of the EEPROM counts the records, each of 8 bytes from address 32 on.
 * Every start adds three records and prints the whole log.
 *
 * Build: avr-gcc -mmcu=atmega328p -DF_CPU=16000000 -Os -o logger.elf logger.c
 */
#include "uart.h"

#include <stdint.h>
#include <stdlib.h>
#include <util/twi.h>

#define DEVICE 0xA0
#define FIRST 32
#define MOST 64

struct record {
	uint16_t number;
	int16_t value;
	char text[4];
};

/* Does one step of the bus and wants the status. */
static void step(uint8_t control, uint8_t status)
{
	TWCR = control | _BV(TWINT) | _BV(TWEN);
	loop_until_bit_is_set(TWCR, TWINT);
	if (TW_STATUS != status) {
		printf("bus: status %02x, wanted %02x\n", TW_STATUS, status);
		end();
	}
}

static void stop(void)
{
	TWCR = _BV(TWSTO) | _BV(TWINT) | _BV(TWEN);
	loop_until_bit_is_clear(TWCR, TWSTO);
}

/* Addresses the device, again and again while it is busy with a write, and gives it an address in its memory. */
static void at(uint16_t address)
{
	for (;;) {
		step(_BV(TWSTA), TW_START);
		TWDR = DEVICE | TW_WRITE;
		TWCR = _BV(TWINT) | _BV(TWEN);
		loop_until_bit_is_set(TWCR, TWINT);
		if (TW_STATUS == TW_MT_SLA_ACK)
			break;
		stop();
	}
	TWDR = address >> 8;
	step(0, TW_MT_DATA_ACK);
	TWDR = address;
	step(0, TW_MT_DATA_ACK);
}

static void load(uint16_t address, void *to, uint8_t length)
{
	uint8_t *byte = to;
	at(address);
	step(_BV(TWSTA), TW_REP_START);
	TWDR = DEVICE | TW_READ;
	step(0, TW_MR_SLA_ACK);
	while (--length) {
		step(_BV(TWEA), TW_MR_DATA_ACK);
		*byte++ = TWDR;
	}
	step(0, TW_MR_DATA_NACK);
	*byte = TWDR;
	stop();
}

/* Within a page of the EEPROM. */
static void store(uint16_t address, const void *from, uint8_t length)
{
	const uint8_t *byte = from;
	at(address);
	while (length--) {
		TWDR = *byte++;
		step(0, TW_MT_DATA_ACK);
	}
	stop();
}

int main(void)
{
	uint16_t count;
	struct record record = { .text = "log" };

	begin();
	TWBR = (F_CPU / 100000 - 16) / 2;
	load(0, &count, sizeof count);
	if (count > MOST - 3) {
		printf("a new log\n");
		count = 0;
	}
	for (uint8_t i = 0; i < 3; i++) {
		record.number = count;
		record.value = 1000 - 7 * (int16_t)count * count;
		store(FIRST + count * sizeof record, &record, sizeof record);
		count++;
	}
	store(0, &count, sizeof count);
	for (uint16_t i = 0; i < count; i++) {
		load(FIRST + i * sizeof record, &record, sizeof record);
		printf("%s %u: %d\n", record.text, record.number, record.value);
	}
	end();
}
