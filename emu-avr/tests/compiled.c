// Runs on every chip: initialized data, the stack, an interrupt by its vector, and the serial port.
#include <avr/interrupt.h>
#include <avr/io.h>

#ifndef UCSR0A
#define UCSR0A UCSRA
#define UCSR0B UCSRB
#define UBRR0L UBRRL
#define UDR0 UDR
#define UDRE0 UDRE
#define TXEN0 TXEN
#endif
#ifndef TIMSK1
#define TIMSK1 TIMSK
#endif

static char text[] = "Hello from ";
static volatile unsigned char overflows;

ISR(TIMER1_OVF_vect)
{
    overflows++;
}

static void put(char c)
{
    while (!(UCSR0A & _BV(UDRE0))) {
    }
    UDR0 = c;
}

static void number(unsigned long n)
{
    if (n >= 10) {
        number(n / 10);
    }
    put('0' + n % 10);
}

int main(void)
{
    UBRR0L = 1;
    UCSR0B = _BV(TXEN0);
    TIMSK1 |= _BV(TOIE1);
    TCCR1B = _BV(CS10);
    sei();
    for (char *c = text; *c; c++) {
        put(*c);
    }
    number(RAMEND);
    put(' ');
    while (overflows < 3) {
    }
    cli();
    number(overflows);
    put('\n');
    for (;;) {
    }
}
