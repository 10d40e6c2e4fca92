/* External interrupts by pins that the program itself drives: edges and levels, two levels of priority, four banks, flags set by hand. */
#include "print.h"

static volatile uint8_t zero, one, order[8], n;
static volatile __bit release, released;

void int0(void) __interrupt(0) __using(1)
{
    if (release) {
        P3_2 = 1; /* s51 keeps one request of a level too many. */
        released = 1;
        return;
    }
    zero++;
    if (n < 8)
        order[n++] = '0';
}

void int1(void) __interrupt(2) __using(2)
{
    one++;
    if (n < 8)
        order[n++] = '1';
    P3_3 = 1;
    if (one == 3) {
        P3_2 = 0; /* Higher level: taken at once, nested in this one. */
        P3_2 = 1;
        if (n < 8)
            order[n++] = 'r';
    }
}

static void wait(void)
{
    uint8_t i;
    for (i = 0; i < 20; i++)
        ;
}

static void show(const char *name)
{
    uint8_t i;
    text(name);
    put(' ');
    number(zero);
    put(' ');
    number(one);
    put(' ');
    for (i = 0; i < n; i++)
        put(order[i]);
    put(' ');
    hex8(TCON & 0x0F);
    put('\n');
    n = 0;
}

void main(void)
{
    start();
    IT0 = 1;
    IT1 = 1;
    IE = 0x85;
    PX0 = 1;
    P3_2 = 0, wait(), P3_2 = 1, wait();
    show("one edge");
    P3_2 = 0, wait(), wait(), P3_2 = 1, P3_2 = 0, wait(), P3_2 = 1;
    show("two edges");
    P3_3 = 0, wait();
    show("other edge");
    EA = 0;
    P3_3 = 0, wait(), P3_3 = 1;
    P3_2 = 0, wait(), P3_2 = 1;
    show("held");
    EA = 1, wait();
    show("both, by priority");
    P3_3 = 0, wait();
    show("nested");
    IT0 = 0;
    release = 1;
    P3_2 = 0, wait();
    put('0' + released);
    show(" level");
    EX0 = 0;
    P3_2 = 0, wait();
    show("level, not enabled");
    P3_2 = 1, wait();
    IE0 = 0;
    IE1 = 1, wait();
    show("flag set by hand");
    end();
}
