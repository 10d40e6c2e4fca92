// Names that compilers mangle: namespaces, overloads, classes, templates; and two as rustc writes them.
typedef unsigned char byte;
#define KEEP __attribute__((noinline, used))

extern "C" byte rust_new(byte) asm("_RNvNtC4pump3app5scale");
extern "C" byte rust_old(byte) asm("_ZN4pump3app5clamp17h0123456789abcdefE");
byte KEEP rust_new(byte x) { return x << 1; }
byte KEEP rust_old(byte x) { return x > 9 ? 9 : x; }

namespace app {
volatile byte result;
static volatile byte count;
byte KEEP area(byte side) { return side * side; }
byte KEEP area(byte a, byte b) { return a * b; }
template <typename T> T KEEP twice(T x) { return x + x; }
struct Pump {
    byte speed;
    byte KEEP run(byte by) { return speed += by; }
};
Pump pump;
}

int main()
{
    for (;;) {
        app::count++;
        app::result = app::area(app::count) + app::area(app::count, 3) + app::twice<byte>(app::count);
        app::result += app::pump.run(rust_new(app::count)) + rust_old(app::result);
    }
}
