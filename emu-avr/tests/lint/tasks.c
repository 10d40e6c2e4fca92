/* Two tasks with stacks of their own in static data, switched by hand. */
#include "common.h"

static uint8_t stacks[2][90];
static uint8_t *volatile kept[3];
static volatile uint8_t running;
static volatile int sums[2];

void switch_to(uint8_t *volatile *from, uint8_t *to) __attribute__((noinline, naked));
void switch_to(uint8_t *volatile *from, uint8_t *to)
{
    asm volatile("push r2\npush r3\npush r4\npush r5\npush r6\npush r7\npush r8\npush r9\npush r10\n"
                 "push r11\npush r12\npush r13\npush r14\npush r15\npush r16\npush r17\npush r28\npush r29\n"
                 "movw r30, r24\nin r0, __SP_L__\nst Z, r0\nin r0, __SP_H__\nstd Z+1, r0\n"
                 "in r0, __SREG__\ncli\nout __SP_H__, r23\nout __SREG__, r0\nout __SP_L__, r22\n"
                 "pop r29\npop r28\npop r17\npop r16\npop r15\npop r14\npop r13\npop r12\npop r11\n"
                 "pop r10\npop r9\npop r8\npop r7\npop r6\npop r5\npop r4\npop r3\npop r2\nret\n");
}

static void yield(void)
{
    uint8_t me = running;
    running = (me + 1) % 3;
    switch_to(&kept[me], kept[running]);
}

static int work(int n)
{
    volatile char b[12];
    for (int i = 0; i < 12; i++)
        b[i] = n + i;
    int s = 0;
    for (int i = 0; i < 12; i++)
        s += b[i];
    yield();
    return s;
}

static void first(void)
{
    for (;;)
        sums[0] += work(1);
}

static void second(void)
{
    for (;;)
        sums[1] += work(2);
}

static uint8_t *task(uint8_t *stack, void (*f)(void))
{
    uint8_t *p = stack + sizeof stacks[0] - 1;
    *p-- = (uint16_t)f;
    *p-- = (uint16_t)f >> 8;
    for (int i = 0; i < 18; i++)
        *p-- = 0;
    return p;
}

int main(void)
{
    begin();
    kept[1] = task(stacks[0], first);
    kept[2] = task(stacks[1], second);
    for (int i = 0; i < 5; i++)
        yield();
    printf("%d %d\n", sums[0], sums[1]);
    return end();
}
