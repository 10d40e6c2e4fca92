/* Timer 0 interrupts once per millisecond (921 or 922 cycles) and timer 2 every 5,000 cycles, at two levels, while the program
 * computes; the output depends only on the ticks. */
#include "print.h"

static volatile uint16_t ticks;
static volatile uint8_t beats, nested;
static volatile __bit inside;

void tick(void) __interrupt(1) __using(1)
{
    TH0 = (uint16_t)-921 >> 8;
    TL0 = (uint16_t)-921 & 0xFF;
    ticks++;
    if (inside)
        nested = 1;
}

void beat(void) __interrupt(5) __using(2)
{
    uint8_t i;
    TF2 = 0;
    beats++;
    inside = 1;
    for (i = 0; i < 250; i++) /* Long enough that a tick of the higher level falls into some beats. */
        ;
    inside = 0;
}

static uint16_t now(void)
{
    uint16_t t;
    EA = 0;
    t = ticks;
    EA = 1;
    return t;
}

static __xdata uint8_t seen[10];

void main(void)
{
    uint16_t sum = 1;
    uint8_t i;
    start();
    TMOD |= 0x01;
    RCAP2H = (uint16_t)-5000 >> 8;
    RCAP2L = (uint16_t)-5000 & 0xFF;
    TH2 = RCAP2H;
    TL2 = RCAP2L;
    PT0 = 1;
    IE = 0xA2;
    TR0 = 1;
    TR2 = 1;
    for (i = 0; i < 10; i++) {
        while (now() < (i + 1) * 20)
            sum = sum * 17 + 3;
        seen[i] = now() / 20;
    }
    EA = 0;
    for (i = 0; i < 10; i++) {
        number(seen[i]);
        put(' ');
    }
    put('\n');
    field("200 ticks", ticks >= 200);
    field("40 beats", beats >= 40);
    field("nested", nested);
    field("computed", sum != 1);
    end();
}
