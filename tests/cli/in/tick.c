/* tick-o0.elf: avr-gcc -mmcu=atmega328p -O0 -gdwarf-4 -std=gnu99 tick.c; a service routine, and recursion. */
#include <avr/interrupt.h>
#include <avr/io.h>

volatile unsigned ticks;

ISR(TIMER0_OVF_vect)
{
    unsigned char old = ticks;
    ticks = old + 1;
}

static long power(int base, unsigned char times)
{
    if (times == 0)
        return 1;
    {
        long part = power(base, times - 1);
        return base * part;
    }
}

int main(void)
{
    TCCR0B = 1;
    TIMSK0 = 1;
    sei();
    for (;;) {
        long all = power(3, 5);
        if (all != 243)
            break;
    }
    return 0;
}
