/* Structures, unions, fields of bits, a linked list, structures by value and by pointer. */
#include "print.h"
#include <string.h>

struct point {
    int8_t x;
    int16_t y;
};

struct item {
    struct item __xdata *next;
    char name[6];
    struct point at;
    struct {
        unsigned kind : 3;
        unsigned level : 5;
        unsigned on : 1;
    } flags;
};

union word {
    uint32_t whole;
    uint16_t half[2];
    uint8_t byte[4];
};

static __xdata struct item items[8];
static struct item __xdata *__xdata head;

static const struct point path[] = { { 1, 2 }, { -3, 400 }, { 127, -500 }, { -128, 32767 } };

static void move(struct point *p, const struct point *by)
{
    p->x += by->x;
    p->y += by->y;
}

static void insert(struct item __xdata *new)
{
    struct item __xdata *__xdata *link = &head;
    while (*link && (*link)->at.y < new->at.y)
        link = &(*link)->next;
    new->next = *link;
    *link = new;
}

void main(void)
{
    uint8_t i;
    struct point here = { 5, 50 }, there;
    struct item __xdata *p;
    union word w;
    start();
    for (i = 0; i < 8; i++) {
        p = items + i;
        strcpy(p->name, "item");
        p->name[4] = 'a' + i;
        p->name[5] = 0;
        p->flags.kind = i * 3;
        p->flags.level = i * 7;
        p->flags.on = i & 1;
        move(&here, &path[i & 3]);
        p->at = here;
        insert(p);
    }
    there = here;
    there.x++;
    field("same", !memcmp(&here, &there, sizeof here));
    for (p = head; p; p = p->next) {
        text(p->name);
        put(' ');
        hex8(p->at.x);
        put(' ');
        hex16(p->at.y);
        put(' ');
        number(p->flags.kind);
        put(' ');
        number(p->flags.level);
        put(p->flags.on ? '+' : '-');
        put('\n');
    }
    w.whole = 0x01020304;
    w.half[1] += w.byte[0];
    hex32(w.whole);
    put('\n');
    field("size", sizeof(struct item));
    end();
}
