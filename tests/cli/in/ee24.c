/* Writes a page of a 24C64 over TWI at 400 kHz, polls for its end, and sends what it reads back over the serial port.
   avr-gcc -mmcu=atmega328p -Os -o ee24.elf ee24.c && avr-objcopy -O ihex ee24.elf ee24.hex */
#include <avr/io.h>

static unsigned char go(unsigned char twcr) {
    TWCR = twcr | 1 << TWINT | 1 << TWEN;
    while (!(TWCR & 1 << TWINT)) {}
    return TWSR & 0xF8;
}
static unsigned char send(unsigned char byte) {
    TWDR = byte;
    return go(0);
}
static void stop(void) {
    TWCR = 1 << TWINT | 1 << TWEN | 1 << TWSTO;
    while (TWCR & 1 << TWSTO) {}
}
static void put(unsigned char byte) {
    while (!(UCSR0A & 1 << UDRE0)) {}
    UDR0 = byte;
}
static const char text[] = "Hi there\n";

int main(void) {
    unsigned char i;
    unsigned polls = 0;
    TWBR = 12;
    UBRR0L = 0;
    UCSR0B = 1 << TXEN0;
    go(1 << TWSTA);
    send(0xA0);
    send(0x01);
    send(0x3C);
    for (i = 0; text[i]; i++) send(text[i]);
    stop();
    do {
        polls++;
        go(1 << TWSTA);
    } while (send(0xA0) != 0x18);
    send(0x01);
    /* The page ends at 13Fh, so the text goes on at 120h. */
    send(0x3C);
    go(1 << TWSTA);
    send(0xA1);
    for (i = 0; i < 4; i++) {
        go(i < 3 ? 1 << TWEA : 0);
        put(TWDR);
    }
    stop();
    go(1 << TWSTA);
    send(0xA0);
    send(0x01);
    send(0x20);
    go(1 << TWSTA);
    send(0xA1);
    for (i = 0; i < 5; i++) {
        go(i < 4 ? 1 << TWEA : 0);
        put(TWDR);
    }
    stop();
    GPIOR1 = polls;
    GPIOR2 = polls >> 8;
    for (;;) {}
}
