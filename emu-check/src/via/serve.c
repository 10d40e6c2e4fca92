/* Lets a checker run a ladder program scan by scan, by bytes:
 *   R g          every bit and integer is filled with g, then PlcInit
 *   I n n on     an input            A n n lo hi   an analog input      B b   a byte has been received
 *   E n n b      a cell of EEPROM    W n n v0 v1 v2 v3   a bit or an integer, by its slot
 *   S            one scan; sends all slots (four bytes each, low byte first), the outputs as written, the
 *                number of bytes sent and the last of them, the duty (255: none yet), two bytes of the bus
 *                transfers, and the EEPROM cells
 *   U            the end
 * The text before this one is the program, and it defines SLOTS, OUTPUTS, EEPROM_CELLS; MOST_INPUTS,
 * MOST_OUTPUTS, MOST_ANALOG, MOST_EEPROM_CELLS (at least 1); look() and poke(), which read and write a slot;
 * get() and put(), which receive and send a byte.
 */
static unsigned char level[MOST_INPUTS], written[MOST_OUTPUTS], cell[MOST_EEPROM_CELLS];
static int analog[MOST_ANALOG];
static int received;
static unsigned char sent, last, duty;
static unsigned duties[16];
static unsigned bus;

unsigned char PlcReadInput(unsigned input) { return level[input]; }
void PlcWriteOutput(unsigned output, unsigned char on) { written[output] = on; }
int PlcReadAdc(unsigned input) { return analog[input]; }
void PlcSetPwm(unsigned char percent) { duty = percent; }
void PlcSetPwmOutput(unsigned output, unsigned char percent) { duties[output % 16] = percent + 1; }
static unsigned char all_duties(void)
{
    unsigned sum = 0, output;
    for (output = 0; output < 16; output++) sum += (2 * output + 1) * duties[output];
    return sum == 0 ? duty : sum % 251;
}
unsigned char PlcReadEeprom(unsigned n) { return cell[n]; }
void PlcWriteEeprom(unsigned n, unsigned char byte) { cell[n] = byte; }

/* No device is on the buses. Their transfers of a scan give a number, from the kind and the bytes of each. */
static void note(unsigned char byte) { bus = (bus * 31u + byte + 1u) & 0xFFFFu; }
void PlcI2cWrite(unsigned char device, unsigned char reg, unsigned char byte);
unsigned char PlcI2cRead(unsigned char device, unsigned char reg);
unsigned char PlcSpi(unsigned char byte);
void PlcI2cWrite(unsigned char device, unsigned char reg, unsigned char byte)
{
    note(0);
    note(device);
    note(reg);
    note(byte);
}

unsigned char PlcI2cRead(unsigned char device, unsigned char reg)
{
    note(1);
    note(device);
    note(reg);
    return 0xFF;
}

unsigned char PlcSpi(unsigned char byte)
{
    note(2);
    note(byte);
    return 0xFF;
}

void PlcSendByte(unsigned char byte)
{
    sent++;
    last = byte;
}

void PlcWaitSent(void);
void PlcWaitSent(void) {}

int PlcReceiveByte(void)
{
    int byte = received;
    received = -1;
    return byte;
}

static unsigned get_two(void)
{
    unsigned n = get();
    return n | (unsigned)get() << 8;
}

static long get_four(void)
{
    unsigned low = get_two(), high = get_two();
    return high < 0x8000u ? (long)high * 65536L + (long)low : (long)low - 65536L - (long)(0xFFFFu - high) * 65536L;
}

static void put_four(long value)
{
    unsigned char i;
    for (i = 0; i < 4; i++)
        put((unsigned char)((unsigned long)value >> 8 * i));
}

static void reset(unsigned char garbage)
{
    unsigned n;
    for (n = 0; n != SLOTS; n++)
        poke(n, (signed char)garbage);
    for (n = 0; n < MOST_INPUTS; n++)
        level[n] = 0;
    for (n = 0; n < MOST_OUTPUTS; n++)
        written[n] = garbage;
    for (n = 0; n < MOST_ANALOG; n++)
        analog[n] = 0;
    for (n = 0; n < MOST_EEPROM_CELLS; n++)
        cell[n] = 0xFF;
    received = -1;
    duty = 255;
    { int n; for (n = 0; n < 16; n++) duties[n] = 0; }
    PlcInit();
}

static void scan(void)
{
    unsigned n;
    sent = 0;
    last = 0;
    bus = 0;
    PlcCycle();
    for (n = 0; n != SLOTS; n++)
        put_four(look(n));
    for (n = 0; n != OUTPUTS; n++)
        put(written[n]);
    put(sent);
    put(last);
    put(all_duties());
    put((unsigned char)(bus & 0xFFu));
    put((unsigned char)(bus >> 8));
    for (n = 0; n != EEPROM_CELLS; n++)
        put(cell[n]);
}

static void serve(void)
{
    unsigned n;
    for (;;)
        switch (get()) {
        case 'R':
            reset(get());
            break;
        case 'I':
            n = get_two();
            level[n] = get();
            break;
        case 'A':
            n = get_two();
            analog[n] = (int)get_two();
            break;
        case 'B':
            received = get();
            break;
        case 'E':
            n = get_two();
            cell[n] = get();
            break;
        case 'W':
            n = get_two();
            poke(n, get_four());
            break;
        case 'S':
            scan();
            break;
        default:
            return;
        }
}
