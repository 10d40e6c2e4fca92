#include "valve.h"

uint16_t top(void);
volatile uint16_t peak;
volatile uint8_t rounds;
const uint8_t limit = 9;

static void work(uint8_t count)
{
    for (uint8_t i = 0; i < count; i++) {
        struct valve *own = &valves[i & 1];
        turn(own, (uint8_t) (i + 2));
    }
}

int main(void)
{
    note(title);
    for (;;) {
        work(3);
        peak = top();
        rounds++;
    }
}
