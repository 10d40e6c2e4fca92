#include <stdint.h>

extern volatile float avg;
volatile uint8_t level;

static void __attribute__((noinline)) init(void)
{
    level = 3;
}

int16_t bend(int16_t by)
{
    init();
    avg = avg * 2;
    return by;
}
