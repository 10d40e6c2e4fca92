#!/usr/bin/env bash
# arduino.sh SKETCH OUTPUT.elf: compiles a sketch for an ATmega328P of 16 MHz with the core of Debian's arduino-core-avr, as its
# platform.txt does, without the IDE. The core is compiled once, into the folder CORE (default: next to the output).
set -euo pipefail
sketch=$1 output=$2
avr=${ARDUINO_AVR:-/usr/share/arduino/hardware/arduino/avr}
core=${CORE:-$(dirname "$output")/core}
chip=(-mmcu=atmega328p -DF_CPU=16000000L -DARDUINO=10819 -DARDUINO_AVR_UNO -DARDUINO_ARCH_AVR
    "-I$avr/cores/arduino" "-I$avr/variants/standard")
tidy=(-Os -ffunction-sections -fdata-sections)
# DECIMAL_DIG: avr-gcc 5 has it in C99 only.
cpp=(-DDECIMAL_DIG=__DECIMAL_DIG__ -std=gnu++11 -fpermissive -fno-exceptions -fno-threadsafe-statics)
if [ ! -f "$core/core.a" ]; then
    mkdir -p "$core"
    for file in "$avr"/cores/arduino/*.c; do
        avr-gcc "${chip[@]}" "${tidy[@]}" -std=gnu11 -w -c "$file" -o "$core/$(basename "$file").o"
    done
    for file in "$avr"/cores/arduino/*.cpp; do
        avr-g++ "${chip[@]}" "${tidy[@]}" "${cpp[@]}" -w -c "$file" -o "$core/$(basename "$file").o"
    done
    for file in "$avr"/cores/arduino/*.S; do
        avr-gcc "${chip[@]}" -x assembler-with-cpp -c "$file" -o "$core/$(basename "$file").o"
    done
    avr-ar rcs "$core/core.new" "$core"/*.o
    mv "$core/core.new" "$core/core.a"
fi
avr-g++ "${chip[@]}" "${tidy[@]}" "${cpp[@]}" -Wall -Wextra -Werror -include Arduino.h -x c++ -c "$sketch" -o "$output.o"
avr-gcc -mmcu=atmega328p -Os -Wl,--gc-sections "$output.o" "$core/core.a" -lm -o "$output"
