/* Interrupts, sleep, timers, ports, the converter, registers that are written whole. */
#include "common.h"

static volatile uint8_t ticks, done;
static volatile uint32_t wide;

ISR(TIMER0_OVF_vect)
{
    ticks++;
    wide += ticks;
}

#ifdef ADC_vect
ISR(ADC_vect)
{
    done = 1;
}
#endif

static uint32_t now(void)
{
    uint32_t copy;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        copy = wide;
    }
    return copy;
}

int main(void)
{
    begin();
    DDRB = 0xFF;
    DDRC = 0xFF;
    DDRD |= 0xF0;
    PORTD |= 4;
    TCCR0B = 2;
    TIMSK0 |= 1 << TOIE0;
    sei();
    set_sleep_mode(SLEEP_MODE_IDLE);
    while (ticks < 5)
        sleep_mode();
#ifdef ADC_vect
    ADMUX = 1 << REFS0;
    ADCSRA = 1 << ADEN | 1 << ADIE | 1 << ADSC | 7;
    while (!done)
        sleep_mode();
    printf("%d\n", ADC < 1024);
#endif
    wdt_enable(WDTO_2S);
    _delay_ms(1);
    wdt_reset();
    wdt_disable();
    PORTB ^= 0x20;
    PORTB |= PINB & 0x0F;
    if (PIND & 4)
        puts("high");
    printf("%d\n", now() > 10);
    return end();
}
