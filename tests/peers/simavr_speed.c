/*
 * Measures how fast simavr's library runs a HEX file: simavr_speed FILE CYCLES [LIMIT].
 *
 * LIMIT is run_cycle_limit, the longest time in cycles that simavr runs without checking its timers; without it the library's
 * default applies. Prints the executed cycles, the CPU seconds, the final state and run_cycle_limit on one line.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include <simavr/sim_avr.h>
#include <simavr/sim_hex.h>

/* Sleeping takes no host time. */
static void no_sleep(avr_t *avr, avr_cycle_count_t cycles)
{
	(void)avr, (void)cycles;
}

static double cpu_seconds(void)
{
	struct timespec t;
	clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
	return t.tv_sec + t.tv_nsec * 1e-9;
}

int main(int argc, char **argv)
{
	if (argc < 3) {
		fputs("usage: simavr_speed FILE.hex CYCLES [LIMIT]\n", stderr);
		return 2;
	}
	uint32_t size = 0, start = 0;
	uint8_t *code = read_ihex_file(argv[1], &size, &start);
	avr_t *avr = avr_make_mcu_by_name("atmega328p");
	if (!code || !avr)
		return 1;
	avr_init(avr);
	avr->frequency = 16000000;
	avr->sleep = no_sleep;
	avr_loadcode(avr, code, size, start);
	avr->pc = start;
	avr->codeend = avr->flashend;
	if (argc > 3)
		avr->run_cycle_limit = strtoull(argv[3], NULL, 0);

	avr_cycle_count_t until = strtoull(argv[2], NULL, 0);
	double before = cpu_seconds();
	int state = cpu_Running;
	while (avr->cycle < until && state != cpu_Done && state != cpu_Crashed)
		state = avr_run(avr);
	double spent = cpu_seconds() - before;
	printf("%" PRIu64 " %.6f %d %" PRIu64 "\n", (uint64_t)avr->cycle, spent, state, (uint64_t)avr->run_cycle_limit);
	return state == cpu_Crashed;
}
