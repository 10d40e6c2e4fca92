/* Texts: reversed words, Roman numerals, base 64, run lengths, a search, a cipher. */
#include "print.h"
#include <string.h>

static const char phrase[] = "never odd or even, a man a plan a canal";
static __xdata char work[64];

static void turn(__xdata char *from, __xdata char *to)
{
    while (from < to) {
        char t = *from;
        *from++ = *to;
        *to-- = t;
    }
}

static void roman(uint16_t n)
{
    static const uint16_t values[] = { 1000, 900, 500, 400, 100, 90, 50, 40, 10, 9, 5, 4, 1 };
    static const char *const names[] = { "M", "CM", "D", "CD", "C", "XC", "L", "XL", "X", "IX", "V", "IV", "I" };
    uint8_t i;
    for (i = 0; n; i++)
        for (; n >= values[i]; n -= values[i])
            text(names[i]);
    put(' ');
}

static void base64(const char *s)
{
    static const char set[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    uint8_t length = strlen(s), i, n;
    for (i = 0; i < length; i += 3) {
        uint32_t v = (uint32_t)s[i] << 16;
        n = length - i;
        if (n > 1)
            v |= (uint16_t)s[i + 1] << 8;
        if (n > 2)
            v |= s[i + 2];
        put(set[v >> 18 & 63]);
        put(set[v >> 12 & 63]);
        put(n > 1 ? set[v >> 6 & 63] : '=');
        put(n > 2 ? set[v & 63] : '=');
    }
    put('\n');
}

static void runs(const char *s)
{
    while (*s) {
        uint8_t n = 1;
        while (s[n] == *s)
            n++;
        number(n);
        put(*s);
        s += n;
    }
    put('\n');
}

void main(void)
{
    uint8_t i, from = 0, n = 0;
    start();
    strcpy(work, phrase);
    for (i = 0; i <= sizeof phrase - 1; i++)
        if (work[i] == ' ' || !work[i]) {
            turn(work + from, work + i - 1);
            from = i + 1;
            n++;
        }
    text(work);
    field(" words", n);
    for (i = 0; work[i]; i++)
        if (work[i] >= 'a' && work[i] <= 'z')
            work[i] = (work[i] - 'a' + 13) % 26 + 'a';
    text(work);
    put('\n');
    for (i = 1; i < 100; i += 13)
        roman(i * 20 + i);
    put('\n');
    base64(phrase);
    base64("ab");
    runs("aaabbccccccdaab");
    field("place", strstr(phrase, "plan") - phrase);
    field("letter", strchr(phrase, ',') - phrase);
    end();
}
