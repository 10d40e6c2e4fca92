/* Long numbers: 30 factorial byte by byte, digits of pi by the spigot, Fibonacci numbers in packed decimal with DA A. */
#include "print.h"

#define DIGITS 24
#define CELLS (DIGITS * 10 / 3 + 1)

static __xdata uint8_t big[33];
static __xdata uint16_t cell[CELLS];
static __idata uint8_t x[6], y[6];

static void multiply(uint8_t by)
{
    uint16_t carry = 0;
    uint8_t i;
    for (i = 0; i < sizeof big; i++) {
        carry += big[i] * by;
        big[i] = carry % 10;
        carry /= 10;
    }
}

static void pi(void)
{
    uint8_t digit, i;
    uint16_t carry;
    for (i = 0; i < CELLS; i++)
        cell[i] = 2;
    for (digit = 0; digit < DIGITS; digit++) {
        carry = 0;
        for (i = CELLS; i--;) {
            uint16_t v = cell[i] * 10 + carry;
            uint16_t base = i ? 2 * i + 1 : 10;
            cell[i] = v % base;
            carry = v / base * i;
            if (!i)
                put('0' + v / 10);
        }
    }
    put('\n');
}

/* x = x + y in packed decimal, least byte first. */
static void add(void) __naked
{
    __asm
        mov  r0, #_x
        mov  r1, #_y
        mov  r2, #6
        clr  c
    00001$:
        mov  a, @r0
        addc a, @r1
        da   a
        mov  @r0, a
        inc  r0
        inc  r1
        djnz r2, 00001$
        ret
    __endasm;
}

void main(void)
{
    uint8_t i, j;
    start();
    big[0] = 1;
    for (i = 2; i <= 30; i++)
        multiply(i);
    for (i = sizeof big; i--;)
        put('0' + big[i]);
    put('\n');
    pi();
    y[0] = 1;
    for (i = 0; i < 50; i++) {
        add();
        for (j = 0; j < 6; j++) {
            uint8_t t = x[j];
            x[j] = y[j];
            y[j] = t;
        }
        if (i % 10 == 9) {
            for (j = 6; j--;)
                hex8(x[j]);
            put('\n');
        }
    }
    end();
}
