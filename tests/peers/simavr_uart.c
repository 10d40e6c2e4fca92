/*
 * What a program sends over USART0 under simavr: simavr_uart FILE.elf CYCLES. The bytes go to stdout as they are.
 */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

static void no_sleep(avr_t *avr, avr_cycle_count_t cycles)
{
	(void)avr, (void)cycles;
}

/* simavr tells what it loads on stdout, where only the program's bytes belong. */
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

int main(int argc, char **argv)
{
	elf_firmware_t firmware = { 0 };
	avr_global_logger_set(to_stderr);
	if (argc != 3 || elf_read_firmware(argv[1], &firmware))
		return 2;
	avr_t *avr = avr_make_mcu_by_name("atmega328p");
	if (!avr)
		return 1;
	avr_init(avr);
	avr->frequency = 16000000;
	avr->vcc = avr->avcc = avr->aref = 5000; /* mV */
	avr->sleep = no_sleep;
	avr_load_firmware(avr, &firmware);

	uint32_t flags = 0;
	avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
	flags &= ~(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
	avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
	avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), sent, NULL);

	avr_cycle_count_t until = strtoull(argv[2], NULL, 0);
	int state = cpu_Running;
	while (avr->cycle < until && state != cpu_Done && state != cpu_Crashed)
		state = avr_run(avr);
	return state == cpu_Crashed;
}
