/*
 * Numbers by printf, whole and floating, with avr-libc's large formatter.
 *
 * Build: avr-gcc -mmcu=atmega328p -DF_CPU=16000000 -Os -o printf.elf printf.c -Wl,-u,vfprintf -lprintf_flt -lm
 */
#include "uart.h"

#include <math.h>
#include <stdint.h>

/* Not known to the compiler, so that nothing is computed before the program runs. */
static volatile int16_t numbers[] = { 0, 7, -42, 12345, INT16_MIN };
static volatile float reals[] = { 0.0, 1.0, -2.5, 3.14159265, 1234.5678, 0.00123 };

int main(void)
{
	begin();
	for (uint8_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
		printf("%d|%6d|%-6d|%06d|%+d|%x|%o|%u\n", numbers[i], numbers[i], numbers[i], numbers[i], numbers[i],
		       numbers[i], numbers[i], numbers[i]);
	printf("%ld %lu %lx %c%s %5.2s| %%\n", -2147483647L, 4294967295UL, 0xDEADBEEFUL, 'a', "bc", "def");
	for (uint8_t i = 0; i < sizeof reals / sizeof *reals; i++)
		printf("%.4f|%10.2f|%.3e|%g\n", (double)reals[i], (double)reals[i], (double)reals[i], (double)reals[i]);
	for (uint8_t i = 1; i < 6; i++) {
		float x = reals[i] < 0 ? -reals[i] : reals[i];
		printf("%.4f %.4f %.4f %.4f\n", sqrt(x), sin(x), log(x), atan2(x, 2));
	}
	printf("%f %f %f\n", (double)(reals[1] / reals[0]), (double)(reals[2] / reals[0]), (double)(reals[0] / reals[0]));
	end();
}
