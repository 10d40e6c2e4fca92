#include "shop.h"

uint16_t price(const struct order *order)
{
    int16_t base = order->kind == KIND_TEA ? 120 : -7;
    long wide = 100000L * order->count;
    int16_t part = scale(base, (int8_t) order->count);
    return (uint16_t) (part + order->at.x + (int16_t) wide);
}
