#include <stdint.h>
#include <avr/pgmspace.h>

enum mode { IDLE, OPEN = 3, SHUT };
typedef struct point { int8_t x, y; } point_t;
typedef uint16_t (*step_fn)(uint16_t, uint8_t);
union word { uint16_t all; uint8_t half[2]; };
struct valve {
    enum mode mode;
    point_t at;
    step_fn step;
    struct valve *next;
    union word level;
    char tag[8];
};

extern struct valve valves[2];
extern const char title[] PROGMEM;
uint16_t climb(uint16_t level, uint8_t by);
uint16_t sink(uint16_t level, uint8_t by);
uint16_t depth(uint16_t of);
void turn(struct valve *valve, uint8_t by);
void note(const char *text);
