/* Frames of all sorts, setjmp, arguments without a number, bit fields, program memory, EEPROM. */
#include "common.h"

static jmp_buf back;
static const char flash[] PROGMEM = "flash text";
uint16_t EEMEM kept = 0x1234;

static int deep(int n)
{
    volatile char frame[10];
    frame[n % 10] = n;
    if (n == 0)
        longjmp(back, 7);
    return deep(n - 1) + frame[n % 10];
}

static int sum(int n, ...)
{
    va_list list;
    va_start(list, n);
    int s = 0;
    while (n--)
        s += va_arg(list, int);
    va_end(list);
    return s;
}

static int variable(int n)
{
    char b[n];
    for (int i = 0; i < n; i++)
        b[i] = i;
    int s = 0;
    for (int i = 0; i < n; i++)
        s += b[i];
    return s;
}

typedef struct {
    uint8_t a : 1, b : 2, c : 5;
    uint16_t w;
} bits;

static bits make(uint8_t x)
{
    bits r;
    r.a = x;
    r.b = x >> 1;
    r.c = x >> 3;
    r.w = x;
    return r;
}

static int (*const table[])(int) = {variable, variable};

int main(void)
{
    begin();
    wdt_disable();
    int r = setjmp(back);
    if (!r)
        deep(12);
    printf("%d %d %d\n", r, sum(3, 1, 2, 3), variable(30) + table[1](5));
    char text[20];
    strcpy_P(text, flash);
    puts(text);
    bits x = make(0xA5);
    printf("%d %d %d %u\n", x.a, x.b, x.c, x.w);
    char *p = alloca(15);
    memset(p, 'z', 14);
    p[14] = 0;
    puts(p);
    eeprom_update_word(&kept, 777);
    printf("%u\n", eeprom_read_word(&kept));
    return end();
}
