/* Switches that compile to jump tables, tables of functions, and a machine of byte codes built of both. */
#include "print.h"

enum { PUSH, ADD, SUB, MUL, DUP, SWAP, OVER, PRINT, JNZ, DEC, STOP };

static const __code uint8_t countdown[] = {
    PUSH, 10, PUSH, 1, SWAP, DUP, PRINT, DUP, PUSH, 2, MUL, PRINT, DEC, DUP, JNZ, 5, PRINT, PUSH, 7, ADD, PRINT, STOP,
};

static int16_t stack[12];

static void machine(const __code uint8_t *code)
{
    uint8_t pc = 0, sp = 0;
    int16_t t;
    for (;;)
        switch (code[pc++]) {
        case PUSH: stack[sp++] = code[pc++]; break;
        case ADD: sp--, stack[sp - 1] += stack[sp]; break;
        case SUB: sp--, stack[sp - 1] -= stack[sp]; break;
        case MUL: sp--, stack[sp - 1] *= stack[sp]; break;
        case DUP: stack[sp] = stack[sp - 1], sp++; break;
        case OVER: stack[sp] = stack[sp - 2], sp++; break;
        case SWAP: t = stack[sp - 1], stack[sp - 1] = stack[sp - 2], stack[sp - 2] = t; break;
        case PRINT: number(stack[--sp]), put(' '); break;
        case DEC: stack[sp - 1]--; break;
        case JNZ:
            if (stack[--sp])
                pc = code[pc];
            else
                pc++;
            break;
        case STOP: put('\n'); return;
        }
}

static uint8_t plus(uint8_t a, uint8_t b) __reentrant { return a + b; }
static uint8_t minus(uint8_t a, uint8_t b) __reentrant { return a - b; }
static uint8_t both(uint8_t a, uint8_t b) __reentrant { return a & b; }
static uint8_t either(uint8_t a, uint8_t b) __reentrant { return a | b; }

static uint8_t (*const functions[])(uint8_t, uint8_t) __reentrant = { plus, minus, both, either };

static const char *month(uint8_t n)
{
    switch (n) {
    case 1: return "January";
    case 2: return "February";
    case 3: return "March";
    case 4: return "April";
    case 5: return "May";
    case 6: return "June";
    case 100: return "hundred";
    case 200: return "two hundred";
    default: return "none";
    }
}

/* A comment stripper of five states. */
static void strip(const char *s)
{
    uint8_t state = 0;
    for (; *s; s++)
        switch (state) {
        case 0:
            if (*s == '/')
                state = 1;
            else {
                put(*s);
                if (*s == '"')
                    state = 4;
            }
            break;
        case 1:
            if (*s == '*')
                state = 2;
            else
                put('/'), put(*s), state = 0;
            break;
        case 2:
            if (*s == '*')
                state = 3;
            break;
        case 3:
            if (*s == '/')
                state = 0;
            else if (*s != '*')
                state = 2;
            break;
        case 4:
            put(*s);
            if (*s == '"')
                state = 0;
        }
    put('\n');
}

void main(void)
{
    uint8_t i;
    start();
    machine(countdown);
    for (i = 0; i < 4; i++)
        hex8(functions[i](0xC5, 0x3A));
    put('\n');
    for (i = 0; i < 8; i++)
        text(month(i)), put(' ');
    text(month(100)), put(' '), text(month(200)), put('\n');
    strip("a/* gone **/b / \"/* kept */\" c/d");
    end();
}
