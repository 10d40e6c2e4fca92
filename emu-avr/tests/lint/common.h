/* What the programs share: the serial port under either of its names, and a way to end. */
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <alloca.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <util/atomic.h>
#include <util/delay.h>

#ifndef UDR0
#define UDR0 UDR
#define UCSR0A UCSRA
#define UCSR0B UCSRB
#define UBRR0L UBRRL
#define UBRR0H UBRRH
#endif
#ifndef TIMSK0
#define TIMSK0 TIMSK
#define TCCR0B TCCR0
#endif

static int put(char c, FILE *file)
{
    while (!(UCSR0A & 0x20))
        ;
    UDR0 = c;
    return 0;
}

static FILE serial = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);

static void begin(void)
{
    UBRR0H = 0;
    UBRR0L = 103;
    UCSR0B = 1 << 3;
    stdout = &serial;
}

/* An end that only a program that has come so far can send. */
static int end(void)
{
    puts("end");
    while (!(UCSR0A & 0x40))
        ;
    cli();
    for (;;)
        ;
}
