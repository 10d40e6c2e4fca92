#include "shop.h"

static const char tea[] = "tea";
static const char bread[] = "bread";

const char *label(enum kind kind)
{
    return kind == KIND_TEA ? tea : bread;
}

int16_t scale(int16_t value, int8_t by)
{
    int16_t buffer[4] = { value, by, 0, 0 };
    union { uint8_t bytes[2]; uint16_t word; } both;
    both.word = (uint16_t) value;
    for (int8_t i = 0; i < by; i++)
        buffer[i & 3] += both.bytes[0];
    return buffer[0];
}
