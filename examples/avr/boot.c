/*
 * A boot loader that writes an application into page 0 and jumps there. The fuses let the chip begin in the boot section, the
 * last 2048 words.
 *
 * The application is code for address 0 that is kept in the boot loader's own section: it prints a line and sleeps.
 *
 * Build: avr-gcc -mmcu=atmega328p -DF_CPU=16000000 -Os -o boot.elf boot.c -Wl,--section-start=.text=0x7000
 */
#include "uart.h"

#include <avr/boot.h>
#include <avr/fuse.h>
#include <avr/pgmspace.h>

FUSES = {
	.low = 0xFF, /* a crystal */
	.high = FUSE_SPIEN & FUSE_BOOTSZ1 & FUSE_BOOTSZ0 & FUSE_BOOTRST,
	.extended = 0xFF,
};

extern const uint8_t application[], application_end[];

__asm__(".pushsection .progmem.application, \"a\"\n"
	"application:\n"
	"	ldi r30, lo8(message - application)\n"
	"	ldi r31, 0\n"
	"1:	lpm r24, Z+\n"
	"	tst r24\n"
	"	breq 3f\n"
	"2:	lds r25, 0xC0\n" /* UCSR0A */
	"	sbrs r25, 5\n" /* UDRE0 */
	"	rjmp 2b\n"
	"	sts 0xC6, r24\n" /* UDR0 */
	"	rjmp 1b\n"
	"3:	ldi r24, 1\n" /* idle mode, SE */
	"	out 0x33, r24\n" /* SMCR */
	"	sleep\n"
	"	rjmp 3b\n"
	"message:\n"
	"	.asciz \"application: hello from page 0\\n\"\n"
	"	.balign 2\n"
	"application_end:\n"
	".popsection\n");

/* Bytes of page 0 that are not as in the boot loader. */
static uint8_t differing(uint8_t length)
{
	uint8_t count = 0;
	for (uint8_t i = 0; i < length; i++)
		count += pgm_read_byte((uint16_t)i) != pgm_read_byte(&application[i]);
	return count;
}

int main(void)
{
	uint8_t length = application_end - application;

	begin();
	printf_P(PSTR("boot loader: %u of %u bytes differ\n"), differing(length), length);
	for (uint8_t i = 0; i < length; i += 2)
		boot_page_fill((uint16_t)i, pgm_read_word(&application[i]));
	boot_page_erase(0);
	boot_spm_busy_wait();
	boot_page_write(0);
	boot_spm_busy_wait();
	boot_rww_enable();
	printf_P(PSTR("page written: %u of %u bytes differ\n"), differing(length), length);
	((void (*)(void))0)();
}
