/*
 * Prints what a program sends on USART0 under simavr: simavr_uart FILE CYCLES [wire]. The bytes go to stdout unchanged, and with
 * `wire` also to the receiver. FILE.elf is loaded as simavr does, only .text and .data; FILE.bin is all of flash.
 */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

static void no_sleep(avr_t *avr, avr_cycle_count_t cycles)
{
	(void)avr, (void)cycles;
}

/* simavr prints what it loads on stdout, which must contain only the program's bytes. */
static void to_stderr(avr_t *avr, const int level, const char *format, va_list ap)
{
	if (!avr || avr->log >= level)
		vfprintf(stderr, format, ap);
}

static void sent(avr_irq_t *irq, uint32_t value, void *param)
{
	(void)irq, (void)param;
	putchar((int)(value & 0xFF));
}

/* The contents of flash. */
static int load(avr_t *avr, const char *name)
{
	static uint8_t flash[0x8000];
	FILE *file = fopen(name, "rb");
	if (!file)
		return 0;
	size_t size = fread(flash, 1, sizeof flash, file);
	fclose(file);
	avr_loadcode(avr, flash, size, 0);
	avr->codeend = size;
	return size > 0;
}

int main(int argc, char **argv)
{
	elf_firmware_t firmware = { 0 };
	avr_global_logger_set(to_stderr);
	if (argc < 3)
		return 2;
	const char *end = strrchr(argv[1], '.');
	int whole = end && !strcmp(end, ".bin");
	if (!whole && elf_read_firmware(argv[1], &firmware))
		return 2;
	avr_t *avr = avr_make_mcu_by_name("atmega328p");
	if (!avr)
		return 1;
	avr_init(avr);
	avr->frequency = 16000000;
	avr->vcc = avr->avcc = avr->aref = 5000; /* mV */
	avr->sleep = no_sleep;
	if (!whole)
		avr_load_firmware(avr, &firmware);
	else if (!load(avr, argv[1]))
		return 2;

	uint32_t flags = 0;
	avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
	flags &= ~(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
	avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
	avr_irq_t *output = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT);
	avr_irq_register_notify(output, sent, NULL);
	if (argc > 3)
		avr_connect_irq(output, avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT));

	avr_cycle_count_t until = strtoull(argv[2], NULL, 0);
	int state = cpu_Running;
	while (avr->cycle < until && state != cpu_Done && state != cpu_Crashed)
		state = avr_run(avr);
	return state == cpu_Crashed;
}
