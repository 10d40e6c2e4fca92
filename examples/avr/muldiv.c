/*
 * Multiplies and divides numbers of 8 to 64 bits, with and without sign, and floating ones, a few hundred of each, and prints a
 * checksum over the results of each kind. Operands come from xorshift32, their sizes from 1 bit to all.
 *
 * Build: avr-gcc -mmcu=atmega328p -DF_CPU=16000000 -Os -o muldiv.elf muldiv.c -lm
 */
#include "uart.h"

#include <stdint.h>
#include <string.h>

static uint32_t state = 2463534242UL;
static uint32_t sum;

static uint32_t next(void)
{
	state ^= state << 13;
	state ^= state >> 17;
	state ^= state << 5;
	return state;
}

/* A number of up to `bits` bits, its length by chance as well. */
static uint64_t operand(uint8_t bits)
{
	uint64_t high = next();
	uint64_t low = next();
	return (high << 32 | low) >> (64 - bits) >> next() % bits;
}

/* FNV-1a, byte for byte from the lowest. */
static void add(uint64_t value, uint8_t bytes)
{
	for (uint8_t i = 0; i < bytes; i++)
		sum = (sum ^ (uint8_t)(value >> 8 * i)) * 16777619UL;
}

#define UNSIGNED(bits, wide) \
	static void __attribute__((noinline)) u##bits(uint16_t times) \
	{ \
		for (uint16_t i = 0; i < times; i++) { \
			uint##bits##_t a = operand(bits), b = operand(bits); \
			add((uint##bits##_t)(a * b), bits / 8); \
			add((uint##wide##_t)a * b, wide / 8); \
			if (b) { \
				add(a / b, bits / 8); \
				add(a % b, bits / 8); \
			} \
		} \
	}

/* The least number by -1 has no quotient in C. */
#define SIGNED(bits, wide) \
	static void __attribute__((noinline)) i##bits(uint16_t times) \
	{ \
		for (uint16_t i = 0; i < times; i++) { \
			int##bits##_t a = operand(bits), b = operand(bits); \
			if (next() & 1) \
				a = -(uint##bits##_t)a; \
			if (next() & 1) \
				b = -(uint##bits##_t)b; \
			add((uint##bits##_t)((uint##bits##_t)a * (uint##bits##_t)b), bits / 8); \
			add((uint##wide##_t)((int##wide##_t)a * b), wide / 8); \
			if (b && !(b == -1 && a == INT##bits##_MIN)) { \
				add((uint##bits##_t)(a / b), bits / 8); \
				add((uint##bits##_t)(a % b), bits / 8); \
			} \
		} \
	}

UNSIGNED(8, 16)
UNSIGNED(16, 32)
UNSIGNED(32, 64)
SIGNED(8, 16)
SIGNED(16, 32)
SIGNED(32, 64)

/* Of 64 bits there is nothing wider. */
static void __attribute__((noinline)) u64(uint16_t times)
{
	for (uint16_t i = 0; i < times; i++) {
		uint64_t a = operand(64), b = operand(64);
		add(a * b, 8);
		if (b) {
			add(a / b, 8);
			add(a % b, 8);
		}
	}
}

static void __attribute__((noinline)) i64(uint16_t times)
{
	for (uint16_t i = 0; i < times; i++) {
		uint64_t a = operand(64), b = operand(64);
		if (next() & 1)
			a = -a;
		if (next() & 1)
			b = -b;
		int64_t x = a, y = b;
		add(a * b, 8);
		if (y && !(y == -1 && x == INT64_MIN)) {
			add(x / y, 8);
			add(x % y, 8);
		}
	}
}

static void add_float(float value)
{
	uint32_t bits;
	memcpy(&bits, &value, sizeof bits);
	add(bits, 4);
}

/* Whole numbers of up to 24 bits by powers of two: neither results nor operands are too large or small. */
static float real(void)
{
	float value = (uint32_t)operand(24) | 1;
	if (next() & 1)
		value = -value;
	for (uint8_t i = next() % 24; i; i--)
		value /= 2;
	return value;
}

static void __attribute__((noinline)) floats(uint16_t times)
{
	for (uint16_t i = 0; i < times; i++) {
		float a = real(), b = real();
		add_float(a * b);
		add_float(a / b);
		add_float(a + b);
		add_float(a - b);
		add((uint32_t)(int32_t)a, 4);
	}
}

static void kind(const char *name, void (*run)(uint16_t), uint16_t times)
{
	sum = 2166136261UL;
	run(times);
	printf("%-3s %08lx\n", name, sum);
}

int main(void)
{
	begin();
	kind("u8", u8, 500);
	kind("i8", i8, 500);
	kind("u16", u16, 500);
	kind("i16", i16, 500);
	kind("u32", u32, 300);
	kind("i32", i32, 300);
	kind("u64", u64, 200);
	kind("i64", i64, 200);
	kind("f32", floats, 300);
	end();
}
