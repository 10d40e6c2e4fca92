#include "valve.h"

const char title[] PROGMEM = "two valves";
static uint8_t calls = 7;
char line[12];

uint16_t climb(uint16_t level, uint8_t by)
{
    uint16_t sum = level + by;
    return sum;
}

uint16_t sink(uint16_t level, uint8_t by)
{
    uint16_t sum = level - depth(by);
    calls++;
    return sum;
}

uint16_t depth(uint16_t of)
{
    if (of == 0)
        return 1;
    uint16_t below = depth(of - 1);
    return below + of;
}

void note(const char *text)
{
    char *to = line;
    char c;
    do {
        c = pgm_read_byte(text++);
        *to++ = c;
    } while (c);
}
