/* A ring, a heap as a queue with priorities, a tree in arrays, a hash table. */
#include "print.h"

#define RING 16

static __xdata uint8_t ring[RING];
static uint8_t first, used;
static __xdata uint16_t heap[40];
static uint8_t heaped;
static __xdata uint8_t left[40], right[40], key[40];
static uint8_t nodes;
static __xdata uint16_t slot[64];

static uint8_t append(uint8_t v)
{
    if (used == RING)
        return 0;
    ring[(first + used++) % RING] = v;
    return 1;
}

static uint8_t take(void)
{
    uint8_t v = ring[first];
    first = (first + 1) % RING;
    used--;
    return v;
}

static void push(uint16_t v)
{
    uint8_t i = ++heaped;
    for (; i > 1 && heap[i / 2] > v; i /= 2)
        heap[i] = heap[i / 2];
    heap[i] = v;
}

static uint16_t pop(void)
{
    uint16_t top = heap[1], v = heap[heaped--];
    uint8_t i = 1, child;
    for (; (child = i * 2) <= heaped; i = child) {
        if (child < heaped && heap[child + 1] < heap[child])
            child++;
        if (heap[child] >= v)
            break;
        heap[i] = heap[child];
    }
    heap[i] = v;
    return top;
}

static void plant(uint8_t k)
{
    uint8_t at = 1;
    key[++nodes] = k;
    if (nodes == 1)
        return;
    for (;;) {
        __xdata uint8_t *side = k < key[at] ? &left[at] : &right[at];
        if (!*side) {
            *side = nodes;
            return;
        }
        at = *side;
    }
}

static uint8_t walk(uint8_t at) __reentrant
{
    uint8_t depth, other;
    if (!at)
        return 0;
    depth = walk(left[at]);
    number(key[at]);
    put(' ');
    other = walk(right[at]);
    return 1 + (depth > other ? depth : other);
}

static uint8_t store(uint16_t v)
{
    uint8_t probes = 1, h = (v * 40503u >> 8) & 63;
    while (slot[h]) {
        h = (h + 1) & 63;
        probes++;
    }
    slot[h] = v;
    return probes;
}

void main(void)
{
    uint16_t v = 1, probes = 0, sum = 0;
    uint8_t i, lost = 0;
    start();
    for (i = 0; i < 60; i++) {
        lost += !append(i);
        if (i % 3 == 0)
            sum = sum * 5 + take();
    }
    field("ring", sum);
    field("lost", lost);
    for (i = 0; i < 30; i++) {
        v = v * 75 % 65521u;
        push(v);
        plant(v);
        probes += store(v);
    }
    while (heaped) {
        hex16(pop());
        put(' ');
    }
    put('\n');
    i = walk(1);
    put('\n');
    field("depth", i);
    field("probes", probes);
    end();
}
