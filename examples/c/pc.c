/* A ladder program on a computer. Standard input holds one line a scan: a character 0 or 1 for each input, in the order of the
   PLC_INPUT_ numbers. Each line is answered with the outputs.

     emu compile welder.ld --emit c -o welder.c
     gcc -DPROGRAM='"welder.c"' -DINPUTS=1 -DOUTPUTS=2 pc.c -o welder

   For programs without analog inputs, PWM, serial line and EEPROM; others need those functions as well (docs/emit.md). */
#include <stdio.h>

#include PROGRAM

static char levels[INPUTS + 1], outputs[OUTPUTS + 1];

unsigned char PlcReadInput(unsigned input) { return levels[input] == '1'; }
void PlcWriteOutput(unsigned output, unsigned char on) { outputs[output] = on ? '1' : '0'; }

int main(void)
{
    unsigned n = 0;
    int c;
    PlcInit();
    while ((c = getchar()) != EOF) {
        if (c == '\n') {
            PlcCycle();
            puts(outputs);
            n = 0;
        } else if (n < INPUTS)
            levels[n++] = (char)c;
    }
    return 0;
}
