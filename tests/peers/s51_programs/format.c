/* Numbers as text: the library's sprintf, and a separate formatter with variable arguments. */
#include "print.h"
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static __xdata char line[64];

static void digits(uint16_t v, uint8_t base, uint8_t width, char pad) __reentrant
{
    char buffer[17];
    uint8_t n = 0;
    do {
        uint8_t d = v % base;
        buffer[n++] = d < 10 ? '0' + d : 'a' + d - 10;
        v /= base;
    } while (v);
    for (; width > n; width--)
        put(pad);
    while (n)
        put(buffer[--n]);
}

static void format(const char *f, ...) __reentrant
{
    va_list list;
    uint8_t width;
    char pad;
    va_start(list, f);
    for (; *f; f++) {
        if (*f != '%') {
            put(*f);
            continue;
        }
        pad = *++f == '0' ? '0' : ' ';
        for (width = 0; *f >= '0' && *f <= '9'; f++)
            width = width * 10 + *f - '0';
        switch (*f) {
        case 'd': {
            int v = va_arg(list, int);
            if (v < 0) {
                put('-');
                v = -v;
            }
            digits(v, 10, width, pad);
            break;
        }
        case 'u': digits(va_arg(list, unsigned), 10, width, pad); break;
        case 'x': digits(va_arg(list, unsigned), 16, width, pad); break;
        case 'o': digits(va_arg(list, unsigned), 8, width, pad); break;
        case 'b': digits(va_arg(list, unsigned), 2, width, pad); break;
        case 'c': put(va_arg(list, int)); break;
        case 's': text(va_arg(list, char *)); break;
        default: put(*f);
        }
    }
    va_end(list);
}

void main(void)
{
    static const int values[] = { 0, 1, -1, 9, 10, 255, -256, 32767, -32767 };
    uint8_t i;
    start();
    for (i = 0; i < sizeof values / sizeof *values; i++)
        format("%6d %05u %04x %o %b%c", values[i], values[i], values[i], values[i], values[i], '\n');
    format("%s %% %c\n", "a text", 'c');
    sprintf(line, "[%d] [%5u] [%-5d] [%05d] [%x]\n", -42, 42u, 42, 42, 0xBEEF);
    text(line);
    sprintf(line, "[%ld] [%lu] [%08lX] [%s] [%c]\n", -123456789L, 4000000000UL, 0xC0FFEEUL, "text", 'z');
    text(line);
    number(strlen(line));
    put('\n');
    end();
}
