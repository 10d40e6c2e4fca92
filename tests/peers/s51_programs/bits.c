/* Bit variables, addressable bits of registers and ports, rotations, bit counts, a shift register. */
#include "print.h"

static __bit a, b, c, carry;
static __data __at(0x2F) uint8_t flags; /* Bits 78h to 7Fh. */
__bit __at(0x78) flag0;
__bit __at(0x7F) flag7;
__sbit __at(0xF0) b0;
__sbit __at(0xF7) b7;

static __bit majority(__bit x, __bit y, __bit z)
{
    return x && y || y && z || x && z;
}

static uint8_t count(uint8_t v)
{
    uint8_t n = 0;
    for (; v; v &= v - 1)
        n++;
    return n;
}

static uint8_t reverse(uint8_t v)
{
    uint8_t i, r = 0;
    for (i = 0; i < 8; i++) {
        r <<= 1;
        if (v & 1)
            r |= 1;
        v >>= 1;
    }
    return r;
}

void main(void)
{
    uint8_t i, v;
    uint16_t shift = 1;
    start();
    for (i = 0; i < 8; i++) {
        a = i & 1;
        b = i & 2;
        c = i & 4;
        carry = majority(a, b, c);
        put('0' + (a ^ b ^ c));
        put('0' + carry);
        put(' ');
    }
    put('\n');
    flags = 0x42;
    flag0 = 1;
    flag7 = !flag0;
    hex8(flags);
    flag7 = flag0;
    flag0 = 0;
    hex8(flags);
    put('\n');
    /* Pins of an open port follow its latch. */
    P1 = 0x5A;
    P1_0 = 1;
    P1_1 ^= 1;
    P1_7 = P1_0 & P1_1;
    P1 |= 0x20;
    hex8(P1);
    B = 0x0F;
    b7 = b0;
    hex8(B);
    F0 = 1;
    put('0' + F0);
    F0 = 0;
    put('0' + F0);
    put('\n');
    for (i = 0, v = 1; i < 16; i++) {
        v = v << 1 | v >> 7;
        v ^= i;
        hex8(v);
        hex8(reverse(v));
        put('0' + count(v));
        put(i % 8 == 7 ? '\n' : ' ');
    }
    for (i = 0; i < 200; i++)
        shift = shift >> 1 ^ (shift & 1 ? 0xB400u : 0u);
    hex16(shift);
    put('\n');
    end();
}
