/* A traffic light on P1.0 (red), P1.1 (yellow) and P1.2 (green), paced by timer 0 at 1 kHz, that tells each change over the serial
   port at 9600 baud (11.0592 MHz). A car on P3.2 (low) asks for green.

     sdcc -mmcs51 --debug traffic.c      gives traffic.ihx (here traffic.hex) and traffic.cdb */
#include <8052.h>

volatile unsigned int ms;
unsigned char changes;

void tick(void) __interrupt(1)
{
    TH0 = 0xFC;                 /* 921.6 cycles a millisecond, less what it takes to get here */
    TL0 = 0x72;
    ms++;
}

void say(const char *text)
{
    while (*text) {
        SBUF = *text++;
        while (!TI)
            ;
        TI = 0;
    }
}

void show(unsigned char lights, const char *name)
{
    P1 = (P1 & 0xF8) | lights;
    changes++;
    say(name);
}

void pause(unsigned int time)
{
    unsigned int start, now;
    EA = 0;
    start = ms;
    EA = 1;
    do {
        EA = 0;
        now = ms;
        EA = 1;
    } while (now - start < time);
}

void main(void)
{
    TMOD = 0x21;                /* timer 1: 8 bits with reload, timer 0: 16 bits */
    TH0 = 0xFC;                 /* the first millisecond */
    TL0 = 0x66;
    TH1 = 0xFD;                 /* 9600 baud */
    SCON = 0x50;
    TCON = 0x50;                /* both timers run */
    IE = 0x82;
    for (;;) {
        show(1, "red\n");
        while (P3_2)
            ;
        pause(20);
        show(3, "red and yellow\n");
        pause(10);
        show(4, "green\n");
        pause(30);
        show(2, "yellow\n");
        pause(10);
    }
}
