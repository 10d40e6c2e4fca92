/* Pointers to every memory, bare and generic, and copies from each to each. */
#include "print.h"
#include <string.h>

static const __code char in_code[] = "code memory";
static __data char in_data[12];
static __idata char in_idata[12];
static __pdata char in_pdata[12];
static __xdata char in_xdata[12];
static __idata __at(0xF0) uint8_t high;

static void upper(char *p)
{
    for (; *p; p++)
        if (*p >= 'a' && *p <= 'z')
            *p -= 32;
}

static uint16_t sum(const char *p)
{
    uint16_t s = 0;
    while (*p)
        s = s * 3 + *p++;
    return s;
}

static void show(const char *p)
{
    text(p);
    put(' ');
    hex16(sum(p));
    put('\n');
}

void main(void)
{
    __code const char *pc = in_code;
    __idata char *pi = in_idata;
    __pdata char *pp = in_pdata;
    __xdata char *px = in_xdata;
    __data char *pd = in_data;
    char *const all[] = { in_data, in_idata, in_pdata, in_xdata };
    uint8_t i, j;
    start();
    while (*pc)
        *pi++ = *pc++;
    for (pi = in_idata; *pi; pi++)
        *pp++ = *pi + 1;
    for (pp = in_pdata; *pp; pp++)
        *px++ = *pp - 1;
    for (px = in_xdata; *px; px++)
        *pd++ = *px;
    for (i = 0; i < 4; i++)
        show(all[i]);
    upper(in_xdata);
    upper(in_idata);
    show(in_code);
    for (i = 0; i < 4; i++)
        for (j = 0; j < 4; j++) {
            memcpy(all[i], all[j], 6);
            all[i][i + j] ^= 0x20;
        }
    for (i = 0; i < 4; i++)
        show(all[i]);
    memmove(in_xdata + 1, in_xdata, 8);
    show(in_xdata);
    field("difference", strcmp(in_data, in_xdata) > 0);
    field("length", strlen(in_pdata));
    high = 0x5A;
    hex8(*(__idata uint8_t *)0xF0);
    *(__xdata uint8_t *)0x7000 = 0xA5;
    hex8(*(volatile __xdata uint8_t *)0x7000);
    hex8(*(__code uint8_t *)0);
    put('\n');
    end();
}
