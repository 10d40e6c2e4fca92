/* Timers 0 and 1 in modes 0, 1, 2 and 3 with interrupts, counted against each other; timer 0 as a counter of pulses at T0. */
#include "print.h"

static volatile uint16_t low, high;

void timer0(void) __interrupt(1) __using(1)
{
    low++;
}

void timer1(void) __interrupt(3) __using(2)
{
    high++;
}

static void settle(const char *name, uint16_t expected, uint16_t got)
{
    text(name);
    text(got == expected || got == expected + 1 || got + 1 == expected ? " as expected\n" : " wrong\n");
}

/* Lets timers 0 and 1 run until the first has overflowed n times. */
static void both(uint8_t mode, uint16_t n)
{
    TR0 = TR1 = 0;
    TMOD = mode;
    TH0 = TL0 = TH1 = TL1 = 0;
    low = high = 0;
    ET0 = ET1 = EA = 1;
    TCON |= 0x50;
    while (low < n)
        ;
    TCON &= ~0x50;
    ET0 = ET1 = EA = 0;
}

void main(void)
{
    uint8_t i;
    uint16_t a, b, c, pulses;
    both(0x00, 4);
    a = high;
    both(0x12, 512);
    b = high;
    both(0x03, 1024);
    c = high;
    /* Pulses of the pin T0, by hand. */
    TMOD = 0x05;
    TH0 = TL0 = 0;
    TR0 = 1;
    for (i = 0; i < 37; i++) {
        P3_4 = 0;
        P3_4 = 1;
    }
    TR0 = 0;
    pulses = TL0;
    TF0 = TF1 = 0;
    start();
    settle("mode 0", 4, a);
    settle("modes 2 and 1", 2, b);
    settle("mode 3", 1024, c);
    field("pulses", pulses);
    end();
}
