/* A program with source lines, from three files:
   avr-gcc -mmcu=atmega328p -Os -gdwarf-4 -gno-record-gcc-switches -fdebug-prefix-map=$PWD=/src -nostartfiles -nostdlib lines.c twice.S -o lines.elf
   avr-strip -g lines.elf -o nolines.elf */
#include "lines.h"

unsigned char twice(unsigned char n);

volatile unsigned char ring[8];
volatile unsigned int total;
unsigned char unset[4];

__attribute__((naked, used, section(".vectors"))) void start(void)
{
    asm volatile("eor r1, r1\n\trjmp main");
}

static __attribute__((noinline)) void put(unsigned char at)
{
    ring[at & 7] = next(at);
    total = twice(at);
}

int main(void)
{
    for (unsigned char i = 0; i < 4; i++)
        put(i);
    if (unset[3])
        put(9);
    for (;;) {
    }
}
