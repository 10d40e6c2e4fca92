#!/bin/sh
# The facts program on peers that no package of Debian has: one line per fact, its name and the values of simavr (another than
# Debian's), avr8js and yasimavr; `none` if the program does not end on that peer. They are the columns before the last one of
# facts.txt. Needs avr-gcc, node with npm, python3 with pip, cc and libelf-dev.
#
# Usage: EMU_SIMAVR=FOLDER tests/peers/avrfacts/others.sh [WORK]   (FOLDER holds sim/ and a built libsimavr.a)
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=${1:-$(mktemp -d)}
simavr=${EMU_SIMAVR:?the folder of a built simavr, with sim/ in it}
cycles=200000000
mkdir -p "$work/include"
cp "$here"/*.c "$here"/*.S "$here"/*.h "$here"/*.mjs "$here"/*.py "$work"
cd "$work"

# Builds the program without the named facts.
build() {
	cp "$here/facts.h" .
	for fact; do
		sed -i "s/X($fact)//" facts.h
	done
	avr-gcc -mmcu=atmega328p -DF_CPU=16000000 -Os -Wl,--section-start=.boot=0x7000 -o facts.elf ./*.c core.S parts.S boot.S
	avr-objcopy -O binary facts.elf facts.bin
}

ln -sfn "$(cd "$simavr/sim" && pwd)" include/simavr
cc -std=gnu11 -O2 -Iinclude -Iinclude/simavr -I"$simavr" -o uart "$here/../simavr_uart.c" "$(find "$simavr" -name libsimavr.a)" -lelf -lm -lutil
build
./uart facts.bin $cycles wire >simavr.txt 2>/dev/null

# A level interrupt prevents the next instruction of the main program forever.
npm install --silent avr8js@0.21.1 >/dev/null
build int_level
node avr8js.mjs $cycles >avr8js.txt

# SLEEP after SEI never ends; conversions and SPM end the run.
pip install --quiet --target packages yasimavr==0.1.6 2>pip.txt
build sei_sleep adc_first adc_next adc_free adc_trigger adc_edge adc_mux adlar adc_lock spm spm_window_4 spm_window_5 spm_time \
	spm_busy spm_rww spm_erase spm_write spm_nrww ee_spm
PYTHONPATH=packages python3 yasimavr_facts.py facts.elf $cycles >yasimavr.txt

# Bytes that the facts send may precede a line.
sed 's/^[^a-z]*//' simavr.txt | while read -r name figure; do
	set -- "$figure"
	for peer in avr8js yasimavr; do
		set -- "$@" "$(sed -n "s/^[^a-z]*$name //p" $peer.txt)"
	done
	echo "$name $1 ${2:-none} ${3:-none}"
done
