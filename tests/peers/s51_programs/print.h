/* Output and end of a run for the programs of this folder. All end with a read of XDATA 7654h. A macro selects the output method:
 *
 * POLLED  the usual way: serial mode 1, 19,200 baud from 11.0592 MHz, with a wait for TI.
 * LOCKED  4,800 baud, with timer 1 running only while a byte is sent: every byte starts at the same state of the dividers.
 * PACED   57,600 baud, and a wait longer than a byte instead of TI: the program does not depend on the serial port.
 * MODE0   the way of compiler test suites: serial mode 0, with TI set by the program first.
 */
#include <8052.h>
#include <stdint.h>

static void halt(void)
{
    (void)*(volatile __xdata uint8_t *)0x7654;
    for (;;)
        ;
}

#if defined(MODE0)
static void start(void) { TI = 1; }
#else
static void start(void)
{
    TMOD = 0x20 | (TMOD & 0x0F);
    PCON |= 0x80;
#ifdef PACED
    TH1 = TL1 = 0xFF; /* 16 machine cycles per bit. */
#elif defined(LOCKED)
    TH1 = TL1 = 0xF4; /* 192 machine cycles per bit; TI to TR1 = 0 takes less than an overflow. */
#else
    TH1 = TL1 = 0xFD; /* 48 machine cycles per bit. */
#endif
#ifdef LOCKED
    SCON = 0x50;
#else
    SCON = 0x52;
    TR1 = 1;
#endif
}
#endif

static void put(char c)
{
#ifdef PACED
    SBUF = c;
    __asm
        mov  r7, #100 ; 200 machine cycles, more than the 10 or 11 bits of a byte
        djnz r7, .
    __endasm;
#elif defined(LOCKED)
    SBUF = c;
    TR1 = 1;
    /* s51 counts in the cycle of the instruction that starts a timer, the chip from the next one on (manual: the write falls at the end
     * of the cycle). From an odd distance, this loop of two cycles sees TI in the same iteration either way. */
    __asm__("nop");
    while (!TI)
        ;
    TR1 = 0;
    TL1 = 0xF4;
    TI = 0;
#else
    while (!TI)
        ;
    TI = 0;
    SBUF = c;
#endif
}

/* Waits for the last byte and ends. */
static void end(void)
{
#ifdef LOCKED
    TR1 = 1; /* The stop bit. */
#elif !defined(PACED)
    while (!TI)
        ;
#endif
    halt();
}

static void text(const char *s)
{
    while (*s)
        put(*s++);
}

static void hex8(uint8_t v)
{
    put("0123456789ABCDEF"[v >> 4]);
    put("0123456789ABCDEF"[v & 15]);
}

static void hex16(uint16_t v)
{
    hex8(v >> 8);
    hex8(v);
}

static void hex32(uint32_t v)
{
    hex16(v >> 16);
    hex16(v);
}

static void number(uint16_t v)
{
    uint16_t power = 10000;
    char begun = 0;
    for (; power; power /= 10) {
        char digit = v / power;
        v %= power;
        if (digit || begun || power == 1) {
            put('0' + digit);
            begun = 1;
        }
    }
}

static void field(const char *name, uint16_t v)
{
    text(name);
    put('=');
    number(v);
    put('\n');
}
