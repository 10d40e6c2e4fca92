/* sdcc -mmcs51 --debug items51.c gives items51.ihx, which is items51.hex, and items51.cdb. */
#include <8051.h>
struct item { unsigned char kind; int amount; char *name; unsigned flag : 1; unsigned lev : 5; };
union pair { unsigned int all; unsigned char part[2]; };
enum mode { IDLE, RUN = 3 };
typedef unsigned char byte;
struct item items[2];
__xdata unsigned int samples[4];
__code const char greeting[] = "hello";
unsigned char count;
static long total;
__bit ready;
union pair both;
enum mode mode;
char *where;
__xdata unsigned int *sample = samples;
__idata char buffer[4];
float ratio;
int add(int a, int b) { return a + b; }
static unsigned char twice(unsigned char of)
{
    static byte calls;
    unsigned char result;
    calls++;
    result = of * 2;
    count += result;
    return result;
}
void main(void)
{
    unsigned char i;
    int sum = 0;
    items[1].amount = -5;
    items[1].name = "abc";
    items[1].lev = 7;
    where = buffer;
    both.all = 0x1234;
    for (i = 0; i < 3; i++) {
        samples[i] = add(i, 1000);
        sum += twice(i);
        buffer[i] = 'a' + i;
    }
    mode = RUN;
    ready = 1;
    total = sum;
    ratio = 1.5;
    while (1)
        ;
}
