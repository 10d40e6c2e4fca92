#include "sensor.h"

static __xdata unsigned char ticks = 3;
unsigned int readings;

unsigned int sensor_read(unsigned char channel)
{
    readings += channel;
    return readings + ticks++;
}
