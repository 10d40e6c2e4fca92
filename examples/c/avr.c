/* A ladder program on an ATmega328P of 16 MHz: inputs at PD2 to PD7, with their pull-ups, outputs at PB0 to PB5, each in the order of
   its numbers. Timer 1 paces the scans.

     emu compile welder.ld --emit c -o welder.c
     avr-gcc -mmcu=atmega328p -Os -DPROGRAM='"welder.c"' avr.c -o welder.elf */
#include <avr/io.h>

#include PROGRAM

#define CLOCK_HZ 16000000UL

unsigned char PlcReadInput(unsigned input) { return PIND >> (2 + input) & 1; }

void PlcWriteOutput(unsigned output, unsigned char on)
{
    if (on)
        PORTB |= (unsigned char)(1 << output);
    else
        PORTB &= (unsigned char)~(1 << output);
}

int main(void)
{
    PORTD = 0xFC;
    DDRB = 0x3F;
    PlcInit();
    /* Clear on match, a tick of 64 clocks: 4 us. */
    OCR1A = (unsigned)(PLC_CYCLE_US / (64000000UL / CLOCK_HZ) - 1);
    TCCR1B = _BV(WGM12) | _BV(CS11) | _BV(CS10);
    for (;;) {
        while (!(TIFR1 & _BV(OCF1A)))
            ;
        TIFR1 = _BV(OCF1A);
        PlcCycle();
    }
}
