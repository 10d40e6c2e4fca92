/* sdcc -mmcs51 --debug main51.c gives main51.ihx, which is main51.hex, main51.cdb, and main51.map (its list of libraries is left out). */
__xdata unsigned char buffer[4];
__bit done;
unsigned char count;

void main(void)
{
    for (count = 0; count < 4; count++)
        buffer[count] = count + 1;
    done = 1;
    for (;;)
        ;
}
