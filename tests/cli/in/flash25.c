/* Identifies a 25Q32 at PB2 with SPI at half the clock, erases a sector, programs bytes, and sends what it reads back.
   avr-gcc -mmcu=atmega328p -Os -o flash25.elf flash25.c && avr-objcopy -O ihex flash25.elf flash25.hex */
#include <avr/io.h>

static unsigned char move(unsigned char byte) {
    SPDR = byte;
    while (!(SPSR & 1 << SPIF)) {}
    return SPDR;
}
static void begin(unsigned char byte) {
    PORTB &= ~(1 << 2);
    move(byte);
}
static void at(unsigned char byte) {
    begin(byte);
    move(0x12);
    move(0x34);
    move(0xFE);
}
static void end(void) { PORTB |= 1 << 2; }
static void wait(void) {
    unsigned i;
    unsigned char busy;
    do {
        for (i = 0; i < 4000; i++) asm volatile("");
        begin(0x05);
        busy = move(0) & 1;
        end();
    } while (busy);
}
static void put(unsigned char byte) {
    while (!(UCSR0A & 1 << UDRE0)) {}
    UDR0 = byte;
}

int main(void) {
    unsigned char i;
    UBRR0L = 0;
    UCSR0B = 1 << TXEN0;
    PORTB = 1 << 2;
    DDRB = 1 << 2 | 1 << 3 | 1 << 5;
    SPCR = 1 << SPE | 1 << MSTR;
    SPSR = 1 << SPI2X;
    begin(0x9F);
    for (i = 0; i < 3; i++) put(move(0));
    end();
    at(0x20); end(); /* Without WREN nothing happens. */
    begin(0x06); end();
    at(0x20); end();
    wait();
    begin(0x06); end();
    at(0x02);
    for (i = 0; i < 4; i++) move("Page"[i]);
    end();
    wait();
    at(0x03);
    for (i = 0; i < 3; i++) put(move(0));
    end();
    begin(0x0B);
    move(0x12); move(0x34); move(0x00); move(0);
    for (i = 0; i < 3; i++) put(move(0));
    end();
    for (;;) {}
}
