/* Byte code on a computer. Standard input holds one line a scan: a character 0 or 1 for each input. Each line is answered with the
   outputs, with the bytes that are sent before them.

     emu compile welder.ld --emit bytecode -o welder.inc
     gcc -DPROGRAM='"welder.inc"' pc.c plc.c -o welder */
#include <stdio.h>

#include "plc.h"

static const unsigned char image[] = {
#include PROGRAM
};

static char levels[256], outputs[257];
static unsigned char cells[65536];

unsigned char PlcReadInput(unsigned input) { return levels[input & 255] == '1'; }
void PlcWriteOutput(unsigned output, unsigned char on) { outputs[output & 255] = on ? '1' : '0'; }
int PlcReadAdc(unsigned input) { return input ? 0 : 512; }
void PlcSetPwm(unsigned char percent) { printf("duty %u\n", percent); }
void PlcSendByte(unsigned char byte) { printf("sent %u\n", byte); }
void PlcWaitSent(void) { fflush(stdout); }
int PlcReceiveByte(void) { return -1; }
void PlcI2cWrite(unsigned char device, unsigned char reg, unsigned char byte) { printf("i2c %u %u %u\n", device, reg, byte); }
unsigned char PlcI2cRead(unsigned char device, unsigned char reg)
{
    printf("i2c %u %u\n", device, reg);
    return 0xFF;
}

unsigned char PlcSpi(unsigned char byte)
{
    printf("spi %u\n", byte);
    return 0xFF;
}

unsigned char PlcReadEeprom(unsigned cell) { return cells[cell & 65535]; }
void PlcWriteEeprom(unsigned cell, unsigned char byte) { cells[cell & 65535] = byte; }

int main(void)
{
    unsigned n;
    int c;
    for (n = 0; n < sizeof cells; n++)
        cells[n] = 0xFF;
    if (PlcLoad(image))
        return 1;
    PlcInit();
    n = 0;
    while ((c = getchar()) != EOF) {
        if (c == '\n') {
            PlcCycle();
            puts(outputs);
            n = 0;
        } else if (n < sizeof levels)
            levels[n++] = (char)c;
    }
    return 0;
}
