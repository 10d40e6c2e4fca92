// Sets up every peripheral of ATmega48 to 328 and 164 to 1284, as a correct program does.
#include "common.h"

static volatile unsigned char changes, ticks, sent;
static unsigned char EEMEM stored;

ISR(PCINT2_vect)
{
    changes++;
}

#ifdef PCINT3_vect
ISR(PCINT3_vect)
{
    changes++;
}
#endif

#ifdef TIMER3_OVF_vect
ISR(TIMER3_OVF_vect)
{
    ticks++;
}
#endif

#ifdef USART1_UDRE_vect
ISR(USART1_UDRE_vect)
{
    UDR1 = 0x55;
    sent++;
    UCSR1B &= ~_BV(UDRIE1);
}
#endif

static void timers(void)
{
    TCCR0A = _BV(COM0A1) | _BV(COM0B1) | _BV(WGM01) | _BV(WGM00);
    TCCR0B = _BV(CS01) | _BV(CS00);
    OCR0A = 10;
    OCR0B = 200;
    TCCR1A = _BV(COM1A1) | _BV(COM1B1) | _BV(WGM11);
    TCCR1B = _BV(WGM13) | _BV(WGM12) | _BV(CS11);
    ICR1 = 1000;
    OCR1A = 300;
    OCR1B = 400;
    TCCR2A = _BV(COM2A0) | _BV(COM2B1) | _BV(WGM21) | _BV(WGM20);
    TCCR2B = _BV(WGM22) | _BV(CS22);
    OCR2A = 99;
#ifdef TCCR3A
    TCCR3A = _BV(COM3A1) | _BV(COM3B1) | _BV(WGM31) | _BV(WGM30);
    TCCR3B = _BV(WGM32) | _BV(CS30);
    OCR3A = 77;
    OCR3B = 88;
    TIMSK3 = _BV(TOIE3);
#endif
}

static void serial_lines(void)
{
#ifdef UCSR1B
    UBRR1 = 103;
    UCSR1A = _BV(U2X1);
    UCSR1C = _BV(UPM11) | _BV(USBS1) | _BV(UCSZ11) | _BV(UCSZ10);
    UCSR1B = _BV(RXEN1) | _BV(TXEN1) | _BV(UDRIE1);
#endif
#ifdef SPCR0
    SPCR0 = _BV(SPE0) | _BV(MSTR0) | _BV(SPR00);
    SPSR0 = _BV(SPI2X0);
    SPDR0 = 0xA5;
    while (!(SPSR0 & _BV(SPIF0))) {
    }
#else
    SPCR = _BV(SPE) | _BV(MSTR) | _BV(SPR0);
    SPSR = _BV(SPI2X);
    SPDR = 0xA5;
    while (!(SPSR & _BV(SPIF))) {
    }
#endif
    TWBR = 72;
    TWSR = 0;
    TWAR = 0x20 << 1 | _BV(TWGCE);
    TWAMR = 0x06;
    TWCR = _BV(TWEN) | _BV(TWEA);
}

static void analog(void)
{
    DIDR0 = _BV(ADC0D);
    DIDR1 = _BV(AIN1D) | _BV(AIN0D);
    ACSR = _BV(ACBG) | _BV(ACIC);
    ADMUX = _BV(REFS1) | _BV(REFS0) | _BV(ADLAR);
    ADCSRB = _BV(ACME);
    ADCSRA = _BV(ADEN) | _BV(ADSC) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);
    while (ADCSRA & _BV(ADSC)) {
    }
    (void)ADCH;
}

static void pins(void)
{
#ifdef JTD
    unsigned char control = MCUCR | _BV(JTD);
    MCUCR = control;
    MCUCR = control;
    DDRA = 0xFE;
    PORTA = 0x02;
    DDRC = 0xFC;
    DDRD = 0xFA;
#else
    DDRC = 0x0E;
    DDRD = 0xFE;
#endif
    DDRB |= 0xAF;
    EICRA = _BV(ISC11) | _BV(ISC01) | _BV(ISC00);
    EIFR = 0xFF;
#ifdef PCMSK3
    PCMSK3 = 0xFF;
    PCICR = _BV(PCIE3) | _BV(PCIE2);
#else
    PCICR = _BV(PCIE2);
#endif
    PCMSK2 = 0xFF;
}

static void power(void)
{
#ifdef PRR1
    PRR1 = _BV(PRTIM3);
    PRR1 = 0;
#endif
#ifdef PRR0
    PRR0 = 0xEF;
    PRR0 = 0;
#endif
    CLKPR = _BV(CLKPCE);
    CLKPR = 0;
    wdt_enable(WDTO_2S);
    wdt_reset();
    wdt_disable();
    GPIOR0 = 0xFF;
    GPIOR2 = GPIOR0;
    OSCCAL = OSCCAL;
    GTCCR = _BV(PSRSYNC);
    eeprom_write_byte(&stored, 0x3C);
    eeprom_busy_wait();
}

// Stops what runs by itself, so that the machine comes to rest after the end.
static void stop(void)
{
    TCCR0B = 0;
    TCCR1B = 0;
    TCCR2B = 0;
#ifdef TCCR3B
    TCCR3B = 0;
#endif
    ADCSRA = 0;
}

int main(void)
{
    begin();
    power();
    pins();
    timers();
    serial_lines();
    analog();
    sei();
    for (unsigned char n = 0; n < 20; n++) {
        PORTD ^= 0x80;
        for (volatile unsigned int i = 0; i < 500; i++) {
        }
    }
#ifndef UCSR1B
    sent = 1;
#endif
    stop();
    printf("%d %d %d\n", changes > 4, eeprom_read_byte(&stored), sent);
    return end();
}
