// stabs.elf: avr-gcc 5.4.0 -mmcu=atmega328p -Os -g -o stabs.elf stabs.c
#include <stdlib.h>

volatile char text[4];

int main(void) {
    itoa(7, (char *)text, 10);
    return 0;
}
