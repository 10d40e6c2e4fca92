/* Interpreter of ladder byte code; see plc.h. Any C89 compiler; an int of 16 bits will do. */
#include "plc.h"

#include <limits.h>

#if defined(__AVR__)
#include <avr/pgmspace.h>
#define AT(p) pgm_read_byte(p)
#else
#define AT(p) (*(p))
#endif

#if UINT_MAX >= 0xFFFFFFFF
typedef int s32;
typedef unsigned u32;
#else
typedef long s32;
typedef unsigned long u32;
#endif

unsigned long PlcCycleUs, PlcBaud, PlcPwmHz;
unsigned PlcInputs, PlcOutputs, PlcAnalog, PlcBits, PlcWords, PlcCells;

static const unsigned char *widths, *tables, *code, *pc;
static unsigned char state[(PLC_MAX_BITS + 7) / 8];
static s32 value[PLC_MAX_WORDS];
static unsigned char width[PLC_MAX_WORDS];

static unsigned char byte(void)
{
    unsigned char b = AT(pc);
    pc++;
    return b;
}

/* Seven bits a byte, the lowest first; bit 7 says that more follow. */
static u32 number(void)
{
    u32 n = 0;
    unsigned char b, shift = 0;
    do {
        b = byte();
        n |= (u32)(b & 0x7F) << shift;
        shift = (unsigned char)(shift + 7);
    } while (b & 0x80);
    return n;
}

/* Twice the value, or twice its complement and one. */
static s32 constant(void)
{
    u32 n = number();
    s32 v = (s32)(n >> 1);
    return n & 1 ? -v - 1 : v;
}

/* The low bytes of n as a number with sign. */
static s32 wrap(u32 n, unsigned char bytes)
{
    u32 top = (u32)0x80 << 8 * (bytes - 1);
    n &= top | (top - 1);
    return n & top ? -(s32)(~n & (top - 1)) - 1 : (s32)n;
}

static u32 little_endian(unsigned char bytes)
{
    u32 n = 0;
    unsigned char i;
    for (i = 0; i < bytes; i++)
        n |= (u32)byte() << 8 * i;
    return n;
}

unsigned char PlcGetBit(unsigned n) { return state[n >> 3] >> (n & 7) & 1; }

void PlcSetBit(unsigned n, unsigned char on)
{
    unsigned char mask = (unsigned char)(1 << (n & 7));
    if (on)
        state[n >> 3] |= mask;
    else
        state[n >> 3] &= (unsigned char)~mask;
}

long PlcGetWord(unsigned n) { return value[n]; }
void PlcSetWord(unsigned n, long v) { value[n] = wrap((u32)v, width[n]); }

unsigned char PlcLoad(const unsigned char *image)
{
    static const unsigned char mark[4] = {'E', 'L', 'B', 1};
    unsigned i;
    pc = image;
    for (i = 0; i < 4; i++)
        if (byte() != mark[i])
            return 1;
    PlcCycleUs = number();
    PlcBaud = number();
    PlcPwmHz = number();
    PlcCells = (unsigned)number();
    PlcInputs = (unsigned)number();
    PlcOutputs = (unsigned)number();
    PlcAnalog = (unsigned)number();
    PlcBits = (unsigned)number();
    PlcWords = (unsigned)number();
    if (PlcBits > PLC_MAX_BITS || PlcWords > PLC_MAX_WORDS)
        return 2;
    widths = pc;
    for (i = 0; i < PlcWords; i++)
        if (byte() & 0x80)
            pc += 4;
    i = (unsigned)number();
    tables = pc;
    code = pc + i;
    return 0;
}

static void write_outputs(void)
{
    unsigned i;
    for (i = 0; i < PlcOutputs; i++)
        PlcWriteOutput(i, PlcGetBit(PlcInputs + i));
}

void PlcInit(void)
{
    unsigned i;
    unsigned char w;
    for (i = 0; i < sizeof state; i++)
        state[i] = 0;
    pc = widths;
    for (i = 0; i < PlcWords; i++) {
        w = byte();
        width[i] = w & 0x7F;
        value[i] = w & 0x80 ? wrap(little_endian(4), 4) : 0;
    }
    write_outputs();
}

/* x / 0 is -1 for x >= 0 and 1 for x < 0; the lowest number / -1 is itself. */
static u32 quotient(s32 a, s32 b)
{
    u32 x = a < 0 ? 0 - (u32)a : (u32)a, y = b < 0 ? 0 - (u32)b : (u32)b;
    if (y == 0)
        return a < 0 ? 1 : 0 - (u32)1;
    x /= y;
    return (a < 0) != (b < 0) ? 0 - x : x;
}

static unsigned char holds(unsigned char op)
{
    s32 a = value[number()];
    s32 b = op & 1 ? constant() : value[number()];
    switch (op >> 1 & 3) {
    case 0: return a == b;
    case 1: return a != b;
    case 2: return a < b;
    default: return a >= b;
    }
}

static void math(unsigned char op)
{
    unsigned dst = (unsigned)number();
    s32 a = op & 2 ? constant() : value[number()];
    s32 b = op & 1 ? constant() : value[number()];
    u32 x = (u32)a, y = (u32)b;
    switch (op & 0x5C) {
    case 0x10: x += y; break;
    case 0x14: x -= y; break;
    case 0x18: x *= y; break;
    case 0x1C: x = quotient(a, b); break;
    case 0x40: x &= y; break;
    case 0x44: x |= y; break;
    case 0x48: x ^= y; break;
    default: /* All bits of the width, without sign. */
        x &= width[dst] < 4 ? ((u32)1 << 8 * width[dst]) - 1 : ~(u32)0;
        x = y > 31 ? 0 : x >> y;
    }
    value[dst] = wrap(x, width[dst]);
}

static s32 lookup(s32 index, unsigned table)
{
    const unsigned char *back = pc;
    unsigned char kind, n;
    u32 found;
    pc = tables + table;
    kind = byte();
    n = kind & 0x7F;
    pc += n * (unsigned)index;
    found = little_endian(n);
    pc = back;
    return kind & 0x80 ? wrap(found, n) : (s32)found;
}

static void persist(unsigned src)
{
    unsigned cell = (unsigned)number(), busy = (unsigned)number();
    s32 scans = (s32)number();
    unsigned char i, b;
    for (i = 0; i < width[src]; i++) {
        b = (unsigned char)((u32)value[src] >> 8 * i);
        if (PlcReadEeprom(cell + i) != b) {
            PlcWriteEeprom(cell + i, b);
            value[busy] = scans;
            return;
        }
    }
}

static void transfer(unsigned char how)
{
    unsigned char device = byte();
    s32 reg = how & 4 ? constant() : value[number()];
    s32 sent = how & 8 ? constant() : value[number()];
    unsigned char got = 0;
    unsigned dst;
    switch (how & 3) {
    case 0: PlcI2cWrite(device, (unsigned char)reg, (unsigned char)sent); break;
    case 1: got = PlcI2cRead(device, (unsigned char)reg); break;
    default: got = PlcSpi((unsigned char)sent); break;
    }
    if (how & 16) {
        dst = (unsigned)number();
        value[dst] = wrap(got, width[dst]);
    }
}

void PlcCycle(void)
{
    unsigned char op, rung = 1, was, i;
    unsigned n, cell;
    s32 v;
    u32 bytes;
    for (n = 0; n < PlcInputs; n++)
        PlcSetBit(n, PlcReadInput(n));
    pc = code;
    while ((op = byte()) != 0x00) {
        if (op >= 0x80) {
            n = op & 31;
            switch (op >> 5) {
            case 4: rung = rung && PlcGetBit(n); break;
            case 5: rung = rung && !PlcGetBit(n); break;
            case 6: rung = PlcGetBit(n); break;
            default: PlcSetBit(n, rung); break;
            }
            continue;
        }
        if (op >= 0x04 && op <= 0x0F) {
            n = (unsigned)number();
            was = PlcGetBit(n);
            switch (op) {
            case 0x04: rung = was; break;
            case 0x05: rung = !was; break;
            case 0x06: rung = rung && was; break;
            case 0x07: rung = rung && !was; break;
            case 0x08: rung = rung || was; break;
            case 0x09: rung = rung || !was; break;
            case 0x0A: PlcSetBit(n, rung); break;
            case 0x0B: PlcSetBit(n, !rung); break;
            case 0x0C: PlcSetBit(n, 0); break;
            case 0x0D: PlcSetBit(n, 1); break;
            case 0x0E: PlcSetBit(n, rung); rung = rung && !was; break;
            default: PlcSetBit(n, rung); rung = !rung && was; break;
            }
            continue;
        }
        if ((op >= 0x10 && op <= 0x1F) || (op >= 0x40 && op <= 0x4F)) {
            math(op);
            continue;
        }
        if (op >= 0x20 && op <= 0x27) {
            was = holds(op);
            rung = rung && was;
            continue;
        }
        if (op >= 0x28 && op <= 0x2F) {
            was = holds(op);
            n = (unsigned)number();
            pc += was ? 0 : n;
            continue;
        }
        n = op <= 0x02 ? 0 : (unsigned)number();
        switch (op) {
        case 0x01: rung = 0; break;
        case 0x02: rung = 1; break;
        case 0x30: value[n] = wrap((u32)value[number()], width[n]); break;
        case 0x31: value[n] = wrap((u32)constant(), width[n]); break;
        case 0x32: pc += n; break;
        case 0x33: pc += rung ? 0 : n; break;
        case 0x34: was = PlcGetBit(n); n = (unsigned)number(); pc += was ? 0 : n; break;
        case 0x35: v = value[number()]; value[n] = wrap((u32)lookup(v, (unsigned)number()), width[n]); break;
        case 0x36: value[n] = wrap((u32)PlcReadAdc((unsigned)number()), width[n]); break;
        case 0x37: v = value[n]; PlcSetPwm((unsigned char)(v < 0 ? 0 : v > 100 ? 100 : v)); break;
        case 0x38: PlcSetPwm((unsigned char)n); break;
        case 0x39: PlcSendByte((unsigned char)value[n]); break;
        case 0x3A: PlcSendByte((unsigned char)n); break;
        case 0x3B:
            v = PlcReceiveByte();
            rung = v >= 0;
            if (rung) value[n] = wrap((u32)v, width[n]);
            break;
        case 0x3C:
            cell = (unsigned)number();
            for (bytes = 0, i = 0; i < width[n]; i++)
                bytes |= (u32)PlcReadEeprom(cell + i) << 8 * i;
            value[n] = wrap(bytes, width[n]);
            break;
        case 0x3D: persist(n); break;
        case 0x3E: value[n] = wrap((u32)value[n] + 1, width[n]); break;
        case 0x3F: value[n] = wrap((u32)value[n] - 1, width[n]); break;
        case 0x50: pc = code + n; break;
        case 0x52: PlcWaitSent(); break;
        case 0x51: transfer((unsigned char)n); break;
        default: return; /* No byte code of this version. */
        }
    }
    write_outputs();
}
