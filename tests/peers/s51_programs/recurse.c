/* Recursion: Fibonacci, Ackermann, the towers of Hanoi, queens on a board, permutations, two functions that call each other. */
#include "print.h"

static uint16_t calls;

static uint16_t fibonacci(uint8_t n) __reentrant
{
    calls++;
    return n < 2 ? n : fibonacci(n - 1) + fibonacci(n - 2);
}

static uint16_t ackermann(uint8_t m, uint16_t n) __reentrant
{
    calls++;
    if (!m)
        return n + 1;
    return ackermann(m - 1, n ? ackermann(m, n - 1) : 1);
}

static void hanoi(uint8_t n, char from, char to, char over) __reentrant
{
    if (!n)
        return;
    hanoi(n - 1, from, over, to);
    calls++;
    put(from);
    put(to);
    hanoi(n - 1, over, to, from);
}

static uint16_t queens(uint8_t all, uint8_t down, uint8_t left, uint8_t right) __reentrant
{
    uint8_t place = all & ~(down | left | right);
    uint16_t found = 0;
    calls++;
    if (down == all)
        return 1;
    while (place) {
        uint8_t bit = place & -place;
        place -= bit;
        found += queens(all, down | bit, (left | bit) << 1, (right | bit) >> 1);
    }
    return found;
}

static char letters[] = "abcd";

static void permute(uint8_t n) __reentrant
{
    uint8_t i;
    if (n == 1) {
        calls++;
        text(letters);
        put(' ');
        return;
    }
    for (i = 0; i < n; i++) {
        uint8_t j = n & 1 ? 0 : i;
        char t;
        permute(n - 1);
        t = letters[j];
        letters[j] = letters[n - 1];
        letters[n - 1] = t;
    }
}

static uint8_t odd(uint8_t n) __reentrant;

static uint8_t even(uint8_t n) __reentrant
{
    return n ? odd(n - 1) : 1;
}

static uint8_t odd(uint8_t n) __reentrant
{
    return n ? even(n - 1) : 0;
}

static void show(const char *name, uint16_t value)
{
    field(name, value);
    field("calls", calls);
    calls = 0;
}

void main(void)
{
    start();
    show("fibonacci", fibonacci(13));
    show("ackermann", ackermann(2, 3));
    hanoi(4, 'A', 'C', 'B');
    show(" hanoi", 4);
    show("queens", queens(0x3F, 0, 0, 0));
    permute(3);
    show("permute", 3);
    field("even", even(20));
    field("odd", odd(10));
    end();
}
