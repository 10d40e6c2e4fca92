// Statics in functions, whose names have the parameters of the function in their middle.
// avr-g++ -mmcu=atmega328p -O1 -nostartfiles -fno-threadsafe-statics statics.cpp -o statics.elf
#define KEEP __attribute__((noinline, used))

KEEP int count(int by)
{
    static int total = 7;
    return total += by;
}

namespace app {
struct Meter {
    char read(char step) const;
};
KEEP char Meter::read(char step) const
{
    static char last = 0x22;
    return last += step;
}
template <class T> KEEP T delay(T value)
{
    static T held = 0x33;
    T old = held;
    held = value;
    return old;
}
} // namespace app

int main()
{
    app::Meter meter;
    for (;;)
        count(meter.read(1) + app::delay<char>(1) + app::delay<int>(2));
}
