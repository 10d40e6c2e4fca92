/* A byte from and to the checker. On an AVR by GPIOR1 and GPIOR0, on an 8051 by two cells of external RAM, whose accesses the
   checker sees; otherwise by the standard streams. */
#if defined(__AVR__)
#include <avr/io.h>
static unsigned char get(void) { return GPIOR1; }
static void put(unsigned char byte) { GPIOR0 = byte; }
#elif defined(__SDCC)
static volatile __xdata __at(0x7FFE) unsigned char inbox;
static volatile __xdata __at(0x7FFF) unsigned char outbox;
static unsigned char get(void) { return inbox; }
static void put(unsigned char byte) { outbox = byte; }
#else
#include <stdio.h>
#include <stdlib.h>
static unsigned char get(void)
{
    int byte = getchar();
    if (byte == EOF)
        exit(0);
    return (unsigned char)byte;
}
static void put(unsigned char byte) { putchar(byte); }
#endif
