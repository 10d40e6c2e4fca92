#include "sensor.h"

__sfr __at(0x90) P1;
__sfr __at(0x8E) AUXR;
__sfr16 __at(0xCCCA) RELOAD;
__sbit __at(0x97) LAMP;
__bit armed;
static __bit hidden;
__bit __at(0x18) fixed_bit;
__data unsigned char fast;
__data __at(0x30) unsigned char fixed;
__idata unsigned char deep[4];
__pdata unsigned char paged;
__xdata unsigned int far_word;
__xdata __at(0x4000) unsigned char door;
static unsigned long total = 0x12345678;
__code const unsigned char squares[5] = { 0, 1, 4, 9, 16 };
__code __at(0x600) const unsigned char table[2] = { 7, 8 };

void on_timer(void) __interrupt(1) __using(1)
{
    static unsigned char ticks;
    ticks++;
    armed = !armed;
}

static unsigned char twice(unsigned char n)
{
    static unsigned char calls;
    unsigned char r = n + n;
    if (hidden) {
        static unsigned char calls;
        calls++;
    }
    calls++;
    return r;
}

unsigned char a_name_longer_than_thirty_two_characters(unsigned char n)
{
    return n ^ fixed;
}

void main(void)
{
    unsigned char i;
    AUXR = 1;
    for (i = 0; i < 5; i++) {
        total += squares[i];
        deep[i & 3] = twice(i);
        far_word += sensor_read(i);
    }
    LAMP = armed;
    fixed_bit = hidden;
    paged = a_name_longer_than_thirty_two_characters(fast);
    door = (unsigned char)total;
    RELOAD = far_word;
    P1 = table[1];
    while (1)
        asm_nudge();
}
