/* A product and a determinant of matrices, and six generations of Life on a torus. */
#include "print.h"

#define N 4
#define SIDE 12

static const int16_t left[N][N] = { { 2, -1, 0, 3 }, { 4, 0, 5, -2 }, { 1, 1, 1, 1 }, { -3, 2, 7, 6 } };
static __xdata int16_t product[N][N];
static __xdata uint8_t board[2][SIDE][SIDE];

static int16_t minor(uint8_t row, uint8_t used) __reentrant
{
    int16_t sum = 0;
    uint8_t column, sign = 0;
    if (row == N)
        return 1;
    for (column = 0; column < N; column++)
        if (!(used & 1 << column)) {
            int16_t term = left[row][column] * minor(row + 1, used | 1 << column);
            sum += sign ? -term : term;
            sign ^= 1;
        }
    return sum;
}

static uint8_t generation(uint8_t from)
{
    uint8_t y, x, to = from ^ 1, alive = 0;
    for (y = 0; y < SIDE; y++)
        for (x = 0; x < SIDE; x++) {
            uint8_t dy, dx, n = 0;
            for (dy = SIDE - 1; dy < SIDE + 2; dy++)
                for (dx = SIDE - 1; dx < SIDE + 2; dx++)
                    n += board[from][(y + dy) % SIDE][(x + dx) % SIDE];
            n -= board[from][y][x];
            board[to][y][x] = n == 3 || n == 2 && board[from][y][x];
            alive += board[to][y][x];
        }
    return alive;
}

void main(void)
{
    uint8_t i, j, k;
    start();
    for (i = 0; i < N; i++) {
        for (j = 0; j < N; j++) {
            for (k = 0; k < N; k++)
                product[i][j] += left[i][k] * left[k][j];
            hex16(product[i][j]);
            put(' ');
        }
        put('\n');
    }
    hex16(minor(0, 0));
    put('\n');
    board[0][1][2] = board[0][2][3] = board[0][3][1] = board[0][3][2] = board[0][3][3] = 1;
    board[0][8][7] = board[0][8][8] = board[0][8][9] = 1;
    for (i = 0; i < 6; i++) {
        number(generation(i & 1));
        put(' ');
    }
    put('\n');
    for (i = 0; i < SIDE; i++) {
        for (j = 0; j < SIDE; j++)
            put(board[0][i][j] ? '#' : '.');
        put('\n');
    }
    end();
}
