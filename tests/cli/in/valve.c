#include "valve.h"

struct valve valves[2] = { { IDLE, { 1, -2 }, climb, &valves[1], { 300 }, "north" }, { SHUT, { 3, 4 }, sink, 0, { 0x1234 }, "south" } };
static uint8_t calls;
step_fn table[3] = { climb, sink, 0 };
step_fn *chosen = table;

static inline __attribute__((always_inline)) uint16_t clamp(uint16_t value)
{
    if (value > 1000)
        value = 1000;
    return value;
}

void turn(struct valve *valve, uint8_t by)
{
    uint16_t before = valve->level.all;
    step_fn step = valve->step;
    calls++;
    valve->level.all = clamp(step(before, by));
    if (valve->level.all == before)
        valve->mode = SHUT;
    else
        valve->mode = OPEN;
}

uint16_t top(void)
{
    return clamp(valves[0].level.all) + clamp(valves[1].level.all);
}
