/* Primes below 4000, one bit per number, in external memory. */
#include "print.h"

#define LIMIT 4000

static __xdata uint8_t composite[LIMIT / 8];

static uint8_t is_prime(uint16_t n)
{
    return !(composite[n >> 3] & 1 << (n & 7));
}

void main(void)
{
    uint16_t i, j, count = 0, last = 2, widest = 0, sum = 0;
    start();
    for (i = 2; i * i < LIMIT; i++)
        if (is_prime(i))
            for (j = i * i; j < LIMIT; j += i)
                composite[j >> 3] |= 1 << (j & 7);
    for (i = 2; i < LIMIT; i++)
        if (is_prime(i)) {
            count++;
            sum += i;
            if (i - last > widest)
                widest = i - last;
            last = i;
            if (i < 60) {
                number(i);
                put(' ');
            }
        }
    put('\n');
    field("primes", count);
    field("last", last);
    field("widest gap", widest);
    field("sum", sum);
    end();
}
