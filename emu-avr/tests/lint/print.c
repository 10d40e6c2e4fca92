/* Text: printf, scanf, conversions, structures that are copied with bytes that nobody wrote. */
#include "common.h"

struct record {
    char name[16];
    int values[5];
    unsigned low : 3;
    unsigned high : 5;
};

static struct record make(const char *name, int k)
{
    struct record r;
    strcpy(r.name, name);
    r.values[0] = k;
    r.low = k;
    r.high = k + 1;
    return r;
}

int main(void)
{
    begin();
    printf("%d %u %x %ld %s %c %5d|%-5d|%05d\n", -5, 7u, 0xbeef, 123456789L, "text", 'q', 42, 42, 42);
    struct record a = make("abc", 3), b;
    b = a;
    printf("%s %d %d %d\n", b.name, b.values[0], b.low, b.high);
    char text[40], copy[20];
    snprintf(text, sizeof text, "%s-%d", "x", 9);
    puts(text);
    strncpy(copy, "hi", 3);
    memcpy(text, copy, sizeof copy);
    puts(text);
    dtostrf(-2.75, 8, 2, text);
    puts(text);
    ltoa(123456, text, 16);
    puts(text);
    int x, n = sscanf("4 -17", "%d", &x);
    printf("%d %d %d %ld %d\n", n, x, atoi("123"), strtol("-77", 0, 0), (int)(100 * atof("2.75")));
    printf("%d %d\n", (int)(1000 * sin(1.0)), (int)(1000 * pow(2.5, 1.5)));
    return end();
}
