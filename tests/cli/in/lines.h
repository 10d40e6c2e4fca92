/* A part of lines.c wherever it is used. */
static inline __attribute__((always_inline)) unsigned char next(unsigned char n)
{
    return n + 3;
}
