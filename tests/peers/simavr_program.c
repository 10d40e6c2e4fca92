/*
 * Runs a program under simavr with external stimuli: simavr_program FILE.elf CYCLES [WHAT..]
 *
 *   pc=ADDRESS        starts at this address, because simavr ignores BOOTRST
 *   eeprom            a two-wire EEPROM of 4 KB at address 50h
 *   CYCLE:uart=BYTE   a byte arrives on USART0
 *   CYCLE:adcN=MV     a voltage at channel N of the converter
 *   CYCLE:XN=LEVEL    a level at pin N of port X
 *
 * Prints `u BYTE CYCLE` for each byte sent on USART0, `g BYTE CYCLE` for each byte written to GPIOR0, `p LEVEL CYCLE` for
 * changes of PB5, `w DUTY CYCLE` for new duties of OC2B, and finally `end STATE CYCLE PC`.
 */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_timer.h>
#include <simavr/avr_twi.h>
#include <simavr/avr_uart.h>
#include <simavr/parts/i2c_eeprom.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

/* The data address of GPIOR0. */
#define GPIOR0 0x3E

struct action {
	avr_cycle_count_t at;
	avr_irq_t *irq;
	uint32_t value;
};

static avr_t *avr;
static i2c_eeprom_t eeprom;

static void no_sleep(avr_t *machine, avr_cycle_count_t cycles)
{
	(void)machine, (void)cycles;
}

/* simavr prints what it loads on stdout, which must contain only the lines above. */
static void to_stderr(avr_t *machine, const int level, const char *format, va_list ap)
{
	if (!machine || machine->log >= level)
		vfprintf(stderr, format, ap);
}

static void report(char kind, uint32_t value)
{
	printf("%c %u %llu\n", kind, value & 0xFF, (unsigned long long)avr->cycle);
}

static void changed(avr_irq_t *irq, uint32_t value, void *kind)
{
	(void)irq;
	report(*(const char *)kind, value);
}

static void written(avr_t *machine, avr_io_addr_t addr, uint8_t value, void *param)
{
	(void)param;
	machine->data[addr] = value;
	report('g', value);
}

static avr_cycle_count_t act(avr_t *machine, avr_cycle_count_t when, void *param)
{
	struct action *action = param;
	(void)machine, (void)when;
	avr_raise_irq(action->irq, action->value);
	return 0;
}

static void fail(const char *what)
{
	fprintf(stderr, "what is %s?\n", what);
	exit(2);
}

static void plan(const char *text)
{
	char name[8];
	long long unsigned at;
	unsigned value, number;
	char port;
	struct action *action = calloc(1, sizeof *action);
	if (sscanf(text, "%llu:%7[^=]=%u", &at, name, &value) != 3)
		fail(text);
	if (!strcmp(name, "uart"))
		action->irq = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
	else if (sscanf(name, "adc%u", &number) == 1)
		action->irq = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + number);
	else if (sscanf(name, "%c%u", &port, &number) == 2)
		action->irq = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), number);
	if (!action->irq)
		fail(text);
	action->at = at;
	action->value = value;
	if (at)
		avr_cycle_timer_register(avr, at, act, action);
	else
		avr_raise_irq(action->irq, value);
}

int main(int argc, char **argv)
{
	elf_firmware_t firmware = { 0 };
	avr_global_logger_set(to_stderr);
	if (argc < 3 || elf_read_firmware(argv[1], &firmware))
		return 2;
	avr = avr_make_mcu_by_name("atmega328p");
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
	avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), changed, "u");
	avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), 5), changed, "p");
	avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_TIMER_GETIRQ('2'), TIMER_IRQ_OUT_PWM1), changed, "w");
	avr_register_io_write(avr, GPIOR0, written, NULL);

	for (int i = 3; i < argc; i++) {
		if (!strncmp(argv[i], "pc=", 3)) {
			avr->pc = avr->reset_pc = strtoul(argv[i] + 3, NULL, 0);
		} else if (!strcmp(argv[i], "eeprom")) {
			i2c_eeprom_init(avr, &eeprom, 0xA0, 0xFE, NULL, sizeof eeprom.ee);
			memset(eeprom.ee, 0xFF, sizeof eeprom.ee);
			i2c_eeprom_attach(avr, &eeprom, AVR_IOCTL_TWI_GETIRQ(0));
		} else {
			plan(argv[i]);
		}
	}

	avr_cycle_count_t until = strtoull(argv[2], NULL, 0);
	int state = cpu_Running;
	while (avr->cycle < until && state != cpu_Done && state != cpu_Crashed)
		state = avr_run(avr);
	printf("end %d %llu %x\n", state, (unsigned long long)avr->cycle, (unsigned)avr->pc);
	return 0;
}
