/* A program that sleeps: idle mode, woken by timer 0 two hundred times. */
#include "print.h"

static volatile uint8_t ticks;

void tick(void) __interrupt(1) __using(1)
{
    TH0 = 0xF8; /* 2,048 cycles. */
    ticks++;
}

void main(void)
{
    uint8_t i, j = 0;
    start();
    TMOD |= 0x01;
    ET0 = 1;
    EA = 1;
    TR0 = 1;
    for (i = 0; i < 200; i++) {
        PCON |= 0x01;
        if (ticks == i + 1) /* One wake for every sleep. */
            j++;
    }
    EA = 0;
    field("ticks", ticks);
    field("awake after each", j);
    end();
}
