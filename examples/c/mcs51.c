/* A ladder program on an 8052 of 12 MHz: inputs at P1, outputs at P0 (which needs resistors to the supply), each in the order of its
   numbers. Timer 2 reloads itself and paces the scans, cycles of up to 65,536 us.

     emu compile welder.ld --emit c -o welder.c
     sdcc -mmcs51 -DPROGRAM='"welder.c"' mcs51.c */
#include <8052.h>

#include PROGRAM

#define COUNTS (65536UL - PLC_CYCLE_US)

unsigned char PlcReadInput(unsigned input) { return P1 >> input & 1; }

void PlcWriteOutput(unsigned output, unsigned char on)
{
    if (on)
        P0 |= (unsigned char)(1 << output);
    else
        P0 &= (unsigned char)~(1 << output);
}

void main(void)
{
    PlcInit();
    RCAP2H = TH2 = (unsigned char)(COUNTS >> 8);
    RCAP2L = TL2 = (unsigned char)COUNTS;
    TR2 = 1;
    for (;;) {
        while (!TF2)
            ;
        TF2 = 0;
        PlcCycle();
    }
}
