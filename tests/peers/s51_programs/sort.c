/* Four sorts of the same numbers: bubble, insertion, shell and a recursive quicksort. */
#include "print.h"

#define N 48

static __xdata uint16_t a[N];
static uint16_t moves;

static void fill(void)
{
    uint16_t v = 12345;
    uint8_t i;
    moves = 0;
    for (i = 0; i < N; i++) {
        v = v * 25173u + 13849u;
        a[i] = v;
    }
}

static void swap(uint8_t i, uint8_t j)
{
    uint16_t t = a[i];
    a[i] = a[j];
    a[j] = t;
    moves++;
}

static void bubble(void)
{
    uint8_t i, n = N, last;
    while (n > 1) {
        last = 0;
        for (i = 1; i < n; i++)
            if (a[i - 1] > a[i]) {
                swap(i - 1, i);
                last = i;
            }
        n = last;
    }
}

static void gap(uint8_t g)
{
    uint8_t i;
    int8_t j;
    for (i = g; i < N; i++)
        for (j = i - g; j >= 0 && a[j] > a[j + g]; j -= g)
            swap(j, j + g);
}

static void quick(int8_t low, int8_t high) __reentrant
{
    int8_t i = low, j = high;
    uint16_t pivot = a[(low + high) / 2];
    while (i <= j) {
        while (a[i] < pivot)
            i++;
        while (a[j] > pivot)
            j--;
        if (i <= j)
            swap(i++, j--);
    }
    if (low < j)
        quick(low, j);
    if (i < high)
        quick(i, high);
}

static void show(const char *name)
{
    uint8_t i;
    uint16_t sum = 0;
    for (i = 0; i < N; i++) {
        sum = sum * 31 + a[i];
        if (i && a[i - 1] > a[i])
            text("not sorted: ");
    }
    text(name);
    put(' ');
    hex16(a[0]);
    put(' ');
    hex16(a[N - 1]);
    put(' ');
    hex16(sum);
    field(" moves", moves);
}

void main(void)
{
    start();
    fill(), bubble(), show("bubble");
    fill(), gap(1), show("insertion");
    fill(), gap(13), gap(4), gap(1), show("shell");
    fill(), quick(0, N - 1), show("quick");
    end();
}
