/* Objects in all memories of an 8051, a service routine, and a parameter without a symbol record (SDCC). */
__sfr __at(0x89) TMOD;
__sfr __at(0x8C) TH0;
__sbit __at(0x8C) TR0;
__sbit __at(0xA9) ET0;
__sbit __at(0xAF) EA;

struct ring { unsigned char head, tail; unsigned char buf[8]; };
struct room { int total; struct ring __xdata *ring; const char *name; };

__xdata struct ring rx = { 3, 1, "abcdefg" };
__xdata int matrix[2][3] = { { 1, 2, 3 }, { 4, 5, -6 } };
__code const unsigned char table[8] = { 10, 11, 12, 13, 14, 15, 16, 17 };
__code const char *const names[2] = { "idle", "armed" };
__idata struct room room;
unsigned char crc = 7;
volatile unsigned char ticks;
__bit ready;

void tick(void) __interrupt(1)
{
    unsigned char n = ticks + 1;
    rx.buf[n & 7] = 'A' + (n & 3);
    ticks = n;
}

unsigned char step(unsigned char crc, unsigned char d)
{
    crc ^= d;
    crc = (crc << 4) ^ table[crc >> 5];
    return crc;
}

void add(struct room *r, int n)
{
    r->total += n;
}

void main(void)
{
    unsigned char i;
    room.ring = &rx;
    room.name = names[1];
    TMOD = 2;
    TH0 = 0x80;
    TR0 = 1;
    ET0 = 1;
    EA = 1;
    for (i = 0; i < 6; i++) {
        crc = step(crc, i);
        add(&room, crc);
    }
    EA = 0;
    ready = 1;
    for (;;)
        crc++;
}
