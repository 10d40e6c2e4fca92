/*
 * Runs single instructions on simavr's atmega328p.
 *
 * Reads all of flash from stdin, then fixed-size cases; runs exactly one instruction per case and writes a fixed-size
 * outcome to stdout. Numbers are little endian; the other side is tests/peers/lockstep.rs. RAM holds a pattern that
 * both sides compute, so that a stray read or write shows.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>

enum { CELLS = 4, CHANGES = 16, NONE = 0xFFFF, RAM = 0x100, END = 0x900 };

struct cell {
	uint16_t addr;
	uint8_t value, pad;
};

struct given {
	uint16_t pc; /* in words */
	uint16_t sp;
	uint8_t sreg, pad[3];
	uint8_t regs[32];
	struct cell cells[CELLS];
};

struct outcome {
	uint8_t state; /* 0 still running, 1 not */
	uint8_t sreg;
	uint16_t sp;
	uint32_t pc; /* in bytes */
	uint32_t cycles;
	uint8_t regs[32];
	uint8_t changes, pad[3];
	struct cell changed[CHANGES];
};

static uint8_t background(uint32_t addr)
{
	return (uint8_t)(addr * 167 + (addr >> 8) * 31 + 13);
}

static void quiet(avr_t *avr, const int level, const char *format, va_list ap)
{
	(void)avr, (void)level, (void)format, (void)ap;
}

/* SREG and SP are reported separately. */
static int counts(uint32_t addr)
{
	return addr >= 32 && (addr < R_SPL || addr > R_SREG);
}

static void set_sreg(avr_t *avr, uint8_t value)
{
	for (int i = 0; i < 8; i++)
		avr->sreg[i] = value >> i & 1;
	avr->interrupt_state = 0;
}

static void run(avr_t *avr, const struct given *g, struct outcome *o)
{
	static uint8_t before[END];

	for (uint32_t addr = RAM; addr < END; addr++)
		avr->data[addr] = background(addr);
	memcpy(avr->data, g->regs, 32);
	for (int i = 0; i < CELLS; i++)
		if (g->cells[i].addr < END)
			avr->data[g->cells[i].addr] = g->cells[i].value;
	_avr_sp_set(avr, g->sp);
	set_sreg(avr, g->sreg);
	memcpy(before, avr->data, END);

	avr->pc = g->pc * 2u;
	avr->state = cpu_Running;
	avr->cycle = 0;
	avr->run_cycle_count = 1;
	avr->run_cycle_limit = 1;
	avr_flashaddr_t next = avr_run_one(avr);

	memset(o, 0, sizeof *o);
	o->state = avr->state != cpu_Running;
	READ_SREG_INTO(avr, o->sreg);
	o->sp = _avr_sp_get(avr);
	o->pc = next;
	o->cycles = avr->cycle;
	memcpy(o->regs, avr->data, 32);
	for (uint32_t addr = 0; addr < END; addr++)
		if (counts(addr) && avr->data[addr] != before[addr] && o->changes < CHANGES)
			o->changed[o->changes++] = (struct cell){ addr, avr->data[addr], 0 };

	for (int i = 0; i < CELLS; i++)
		if (g->cells[i].addr >= 32 && g->cells[i].addr < RAM)
			avr->data[g->cells[i].addr] = 0;
}

int main(void)
{
	avr_global_logger_set(quiet);
	avr_t *avr = avr_make_mcu_by_name("atmega328p");
	if (!avr) {
		fputs("simavr knows no atmega328p\n", stderr);
		return 1;
	}
	avr_init(avr);
	avr->log = LOG_NONE;
	avr->codeend = avr->flashend;
	if (fread(avr->flash, avr->flashend + 1, 1, stdin) != 1)
		return 1;

	struct given g;
	struct outcome o;
	while (fread(&g, sizeof g, 1, stdin) == 1) {
		run(avr, &g, &o);
		if (fwrite(&o, sizeof o, 1, stdout) != 1)
			return 1;
	}
	return 0;
}
