/*
 * qsort, bsearch, malloc, and setjmp out of a deep recursion.
 *
 * Build: avr-gcc -mmcu=atmega328p -DF_CPU=16000000 -Os -o sort.elf sort.c
 */
#include "uart.h"

#include <setjmp.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static const char *words[] = { "pear", "apple", "fig", "quince", "cherry", "date", "banana", "grape" };
static jmp_buf out;

static int by_number(const void *a, const void *b)
{
	int16_t x = *(const int16_t *)a, y = *(const int16_t *)b;
	return (x > y) - (x < y);
}

static int by_text(const void *a, const void *b)
{
	return strcmp(*(const char *const *)a, *(const char *const *)b);
}

/* Goes down by n's Collatz steps and leaves with their number from the bottom. */
static uint16_t __attribute__((noinline)) dive(uint32_t n, uint16_t depth)
{
	if (n == 1)
		longjmp(out, depth);
	return dive(n & 1 ? 3 * n + 1 : n / 2, depth + 1) + 1;
}

int main(void)
{
	begin();
	int16_t *numbers = malloc(100 * sizeof *numbers);
	uint16_t seed = 1;
	for (uint8_t i = 0; i < 100; i++)
		numbers[i] = seed = seed * 25173 + 13849;
	qsort(numbers, 100, sizeof *numbers, by_number);
	for (uint8_t i = 0; i < 100; i += 9)
		printf("%d%c", numbers[i], i == 99 ? '\n' : ' ');
	int16_t wanted = numbers[37];
	int16_t *found = bsearch(&wanted, numbers, 100, sizeof *numbers, by_number);
	printf("found at %u\n", (unsigned)(found - numbers));
	free(numbers);

	qsort(words, 8, sizeof *words, by_text);
	for (uint8_t i = 0; i < 8; i++)
		printf("%s%c", words[i], i == 7 ? '\n' : ' ');

	for (volatile uint32_t n = 2; n < 60; n += 25) {
		uint16_t depth = setjmp(out);
		if (!depth)
			dive(n, 0);
		printf("%lu takes %u steps\n", n, depth);
	}
	end();
}
