/* Floating point: series, roots, conversions, comparisons; results as bits, so that not one of them may differ. */
#include "print.h"

static void bits(float f)
{
    union {
        float f;
        uint32_t u;
    } v;
    v.f = f;
    hex32(v.u);
    put(' ');
}

static void fixed(float f)
{
    uint16_t whole;
    if (f < 0) {
        put('-');
        f = -f;
    }
    f += 0.00005f;
    whole = f;
    number(whole);
    put('.');
    f = (f - whole) * 10000;
    whole = f;
    put('0' + whole / 1000);
    put('0' + whole / 100 % 10);
    put('0' + whole / 10 % 10);
    put('0' + whole % 10);
    put('\n');
}

static float root(float x)
{
    float r = x > 1 ? x / 2 : 1;
    uint8_t i;
    for (i = 0; i < 12; i++)
        r = (r + x / r) / 2;
    return r;
}

static float sine(float x)
{
    float term = x, sum = x;
    uint8_t i;
    for (i = 1; i < 8; i++) {
        term = -term * x * x / ((2 * i) * (2 * i + 1));
        sum += term;
    }
    return sum;
}

static float power_of_e(float x)
{
    float term = 1, sum = 1;
    uint8_t i;
    for (i = 1; i < 15; i++) {
        term = term * x / i;
        sum += term;
    }
    return sum;
}

void main(void)
{
    static const float samples[] = { 0.5f, 1, 2, 3.14159265f, 100, 12345.678f, 1e-6f, 1e20f };
    uint8_t i;
    float sum = 0;
    start();
    for (i = 0; i < sizeof samples / sizeof *samples; i++) {
        float x = samples[i];
        bits(x * 3);
        bits(1 / x);
        bits(x - 1);
        bits(root(x));
        bits((float)(int16_t)(x < 30000 ? x : -5));
        put('0' + (x < 2) + 2 * (x == 2));
        put('\n');
        sum += x < 1e6f ? x : 0;
    }
    fixed(sum);
    fixed(root(2));
    fixed(sine(1));
    fixed(sine(-0.5f));
    fixed(power_of_e(1));
    fixed(power_of_e(-2));
    end();
}
