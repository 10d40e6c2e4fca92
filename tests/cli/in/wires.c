/* Types and places of breakpoints: avr-gcc -mmcu=atmega328p -Og -gdwarf-4 -gno-record-gcc-switches -fdebug-prefix-map=$PWD=. wires.c wire2.c -o wires.elf and -O0 .. -o wires0.elf. */
#include <stdint.h>

enum heat { COLD, HEAT, FAULT = 200 };

volatile float avg = 4.5f;
volatile enum heat state = FAULT;
int16_t samples[6] = { 1, 2, 3, 4, 5, 6 };
int16_t *volatile next = &samples[4];
char title[12] = "wire";
volatile uint8_t ticks;

int16_t bend(int16_t by);

static void init(void) { ticks = 1; }

int16_t __attribute__((noinline)) twice(int16_t by) { return (int16_t) (by + by); }

static int16_t __attribute__((noinline)) count(int16_t by)
{
    static uint8_t calls = 7;
    calls++;
    return (int16_t) (by + calls);
}

int main(void)
{
    init();
    for (uint8_t i = 0; i < 3; i++)
        samples[i] = twice(i);
    state = HEAT;
    return bend(count(samples[1]));
}
