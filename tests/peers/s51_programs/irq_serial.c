/* All text goes through a ring that the serial interrupt empties, at 57,600 baud, while the program computes. */
#include "print.h"

#define RING 32

static volatile __idata char ring[RING];
static volatile uint8_t head, tail;
static volatile __bit idle = 1;

void serial(void) __interrupt(4) __using(1)
{
    if (RI)
        RI = 0;
    if (TI) {
        TI = 0;
        if (head == tail)
            idle = 1;
        else {
            SBUF = ring[tail];
            tail = (tail + 1) & (RING - 1);
        }
    }
}

static void send(char c)
{
    uint8_t next = (head + 1) & (RING - 1);
    while (next == tail)
        ;
    ring[head] = c;
    ES = 0;
    head = next;
    if (idle) {
        idle = 0;
        TI = 1; /* Enters the interrupt, which takes the first byte. */
    }
    ES = 1;
}

static void send_text(const char *s)
{
    while (*s)
        send(*s++);
}

void main(void)
{
    uint16_t a = 1, b = 1, t;
    uint8_t i;
    start();
    TH1 = 0xFF;
    TI = 0;
    EA = 1;
    send_text("sent by interrupt: ");
    for (i = 0; i < 22; i++) {
        send("0123456789ABCDEF"[a >> 12]);
        send("0123456789ABCDEF"[a >> 8 & 15]);
        send("0123456789ABCDEF"[a >> 4 & 15]);
        send("0123456789ABCDEF"[a & 15]);
        send(' ');
        t = a + b;
        a = b;
        b = t;
    }
    send_text("\ndone\n");
    while (!idle)
        ;
    halt();
}
