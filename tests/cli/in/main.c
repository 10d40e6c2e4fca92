#include "shop.h"

struct order last;
static uint8_t turns;
volatile uint16_t sum;
float rate = 1.5f;

static uint16_t total(const struct order *of, uint8_t count)
{
    uint16_t all = 0;
    for (uint8_t i = 0; i < count; i++) {
        uint16_t each = price(of + i);
        all += each;
    }
    return all;
}

int main(void)
{
    struct order orders[3] = { { 3, KIND_TEA, { 1, 2 }, 5, 2 }, { 4, KIND_BREAD, { 3, 4 }, 6, 1 }, { 5, KIND_TEA, { 7, 8 }, 1, 3 } };
    const char *name = label(KIND_BREAD);
    for (;;) {
        sum = total(orders, 3);
        last = orders[turns % 3];
        last.kind = name[0] == 'b' ? KIND_BREAD : KIND_TEA;
        turns++;
    }
}
