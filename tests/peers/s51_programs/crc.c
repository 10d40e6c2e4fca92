/* Checksums of one text in code memory and of its copy in external memory. */
#include "print.h"

static const __code char message[] = "The quick brown fox jumps over the lazy dog";
static __xdata char copy[sizeof message];

static uint8_t crc8(const char *p)
{
    uint8_t crc = 0, i;
    for (; *p; p++) {
        crc ^= *p;
        for (i = 8; i; i--)
            crc = crc & 0x80 ? crc << 1 ^ 0x07 : crc << 1;
    }
    return crc;
}

static uint16_t crc16(const char *p)
{
    uint16_t crc = 0xFFFF;
    uint8_t i;
    for (; *p; p++) {
        crc ^= (uint16_t)(uint8_t)*p << 8;
        for (i = 8; i; i--)
            crc = crc & 0x8000 ? crc << 1 ^ 0x1021 : crc << 1;
    }
    return crc;
}

static uint32_t crc32(const char *p)
{
    uint32_t crc = 0xFFFFFFFF;
    uint8_t i;
    for (; *p; p++) {
        crc ^= (uint8_t)*p;
        for (i = 8; i; i--)
            crc = crc & 1 ? crc >> 1 ^ 0xEDB88320 : crc >> 1;
    }
    return ~crc;
}

static uint32_t adler(const char *p)
{
    uint16_t a = 1, b = 0;
    for (; *p; p++) {
        a = (a + (uint8_t)*p) % 65521u;
        b = ((uint32_t)b + a) % 65521u;
    }
    return (uint32_t)b << 16 | a;
}

static void show(const char *p)
{
    hex8(crc8(p));
    put(' ');
    hex16(crc16(p));
    put(' ');
    hex32(crc32(p));
    put(' ');
    hex32(adler(p));
    put('\n');
}

void main(void)
{
    uint8_t i;
    start();
    show(message);
    for (i = 0; i < sizeof message; i++)
        copy[i] = message[i];
    show(copy);
    copy[4] = 'Q';
    show(copy);
    copy[0] = 0;
    show(copy);
    end();
}
