typedef unsigned char uint8_t;
typedef signed char int8_t;
typedef unsigned int uint16_t;
typedef int int16_t;

enum kind { KIND_TEA, KIND_BREAD = 4 };
typedef struct { int8_t x; int8_t y; } point_t;
struct order {
    uint8_t count;
    enum kind kind;
    point_t at;
    uint8_t low : 3;
    uint8_t high : 5;
};
uint16_t price(const struct order *order);
const char *label(enum kind kind);
int16_t scale(int16_t value, int8_t by);
