/* The heap, sorting, wide numbers. */
#include "common.h"

struct node {
    struct node *next;
    int key;
    char unused[7];
};

static int compare(const void *a, const void *b)
{
    return *(const int *)a - *(const int *)b;
}

int main(void)
{
    begin();
    struct node *list = 0;
    for (int i = 0; i < 10; i++) {
        struct node *n = malloc(sizeof *n);
        n->next = list;
        n->key = i * i % 7;
        list = n;
    }
    int sum = 0;
    for (struct node *p = list; p; p = p->next)
        sum += p->key;
    while (list) {
        struct node *next = list->next;
        free(list);
        list = next;
    }
    char *text = malloc(20);
    strcpy(text, "hello");
    text = realloc(text, 60);
    strcat(text, " there");
    puts(text);
    free(text);
    int *a = calloc(20, sizeof *a);
    for (int i = 0; i < 20; i++)
        a[i] = rand() % 100;
    qsort(a, 20, sizeof *a, compare);
    int *found = bsearch(&a[7], a, 20, sizeof *a, compare);
    printf("%d %d %d\n", sum, a[0] <= a[19], found && *found == a[7]);
    free(a);
    uint32_t x = 123456789;
    int64_t y = x;
    for (int i = 1; i < 20; i++) {
        y = y * 6364136223846793005LL + 1442695040888963407LL;
        x ^= y / (1000003L + i);
        x %= 0x7fffffff;
    }
    float f = x;
    for (int i = 1; i < 10; i++)
        f *= 1.5f / (i + 0.25f);
    printf("%lu %ld %d\n", x, (long)-f, f < 0);
    return end();
}
