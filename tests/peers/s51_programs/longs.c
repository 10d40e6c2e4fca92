/* 32-bit arithmetic: products, quotients, remainders, shifts, signs; a power, a root, a greatest divisor, a product of 64 bits. */
#include "print.h"

static const uint32_t samples[] = { 0, 1, 7, 255, 65536, 0x12345678, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF };

static uint32_t high, low;

/* high:low = a * b, from four products of halves. */
static void wide(uint32_t a, uint32_t b)
{
    uint32_t middle = (a >> 16) * (b & 0xFFFF), other = (a & 0xFFFF) * (b >> 16);
    low = (a & 0xFFFF) * (b & 0xFFFF);
    high = (a >> 16) * (b >> 16) + (middle >> 16) + (other >> 16);
    middle <<= 16;
    other <<= 16;
    low += middle;
    high += low < middle;
    low += other;
    high += low < other;
}

static uint32_t root(uint32_t v)
{
    uint32_t r = 0, bit = 0x40000000;
    for (; bit; bit >>= 2) {
        if (v >= r + bit) {
            v -= r + bit;
            r = (r >> 1) + bit;
        } else
            r >>= 1;
    }
    return r;
}

static uint32_t divisor(uint32_t a, uint32_t b)
{
    while (b) {
        uint32_t t = a % b;
        a = b;
        b = t;
    }
    return a;
}

static uint32_t power(uint32_t base, uint16_t exponent, uint32_t modulus)
{
    uint32_t r = 1;
    for (; exponent; exponent >>= 1) {
        if (exponent & 1)
            r = r * base % modulus;
        base = base * base % modulus;
    }
    return r;
}

void main(void)
{
    uint8_t i, j;
    start();
    for (i = 1; i < sizeof samples / sizeof *samples; i++) {
        uint32_t a = samples[i], sum = 0;
        int32_t s = a;
        for (j = 1; j < sizeof samples / sizeof *samples; j++) {
            uint32_t b = samples[j];
            sum = sum * 33 ^ a * b ^ a / b ^ a % b ^ (uint32_t)(s / ((int32_t)b | 2)) ^ (uint32_t)(s % ((int32_t)b | 2));
            sum += (a << j) ^ (a >> j) ^ (uint32_t)(s >> j);
            sum += (a < b) + (s < (int32_t)b);
        }
        hex32(sum);
        put(' ');
        hex32(root(a));
        put(' ');
        hex32(divisor(a, 0x12345600));
        put('\n');
    }
    for (i = 1; i < sizeof samples / sizeof *samples; i++) {
        wide(samples[i], 0xDEADBEEF);
        hex32(high);
        hex32(low);
        put('\n');
    }
    hex32(power(3, 1000, 65521));
    put('\n');
    end();
}
