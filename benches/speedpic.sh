#!/usr/bin/env bash
# Runs the same HEX files on gpsim and on this emulator in the same minute and prints emulated million instruction cycles per CPU second
# (user time), and the ratio.
#
# Usage: benches/speedpic.sh [ROUNDS]   (needs gpsim; builds with cargo unless EMU_SPEEDPIC says "gpsim only"). Every
# program runs ROUNDS times (3) on each side in turn; the best round of each side counts, because disturbances only
# slow a run down. A run of gpsim ends at a breakpoint on the cycle counter; its start, about 0.02 s, is part of it.
set -euo pipefail
cd "$(dirname "$0")/.."
rounds=${1:-3}
only=${EMU_SPEEDPIC:-}
# Cycles: theirs awake and asleep, ours awake and asleep.
theirs=200000000
theirs_asleep=1000000000
ours=1000000000
ours_asleep=100000000000

target=$(cargo metadata --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
out=$target/peers/speedpic
mkdir -p "$out"
if [ -z "$only" ]; then
	cargo build --release --quiet --example speedpic
	speed=$target/release/examples/speedpic
fi

grep -m1 'model name' /proc/cpuinfo | sed 's/.*: //'
echo "$(gpsim --version 2>&1 | head -n 1 | sed 's/ *#.*//'): -i, p16f873, 20 MHz, no log"
echo "emu: release build, pic16f873 at 20 MHz, all peripherals; million instruction cycles/s, best of $rounds"
printf '%-9s %10s %12s %8s\n' program gpsim emu ratio

# Best rate of the lines "cycles seconds .." on stdin, in millions per second.
best() { awk '{ r = $1 / $2 / 1e6; if (r > m) m = r } END { printf "%.1f", m }'; }

# "cycles seconds" of gpsim on a HEX file.
gpsim_run() {
	local reached spent
	TIMEFORMAT=%U
	printf 'load p16f873 %s\nfrequency 20000000\nbreak c %s\nrun\ncycles\nquit\n' "$1" "$2" >"$out/gpsim.stc"
	spent=$({ time gpsim -i -c "$out/gpsim.stc" >"$out/gpsim.txt" 2>/dev/null </dev/null; } 2>&1)
	reached=$(sed -n 's/^\(\*\*gpsim> \)*\([0-9]*\) = 0x[0-9A-F]*$/\2/p' "$out/gpsim.txt" | tail -n 1)
	echo "$reached $spent"
}

for program in alu crc tmr0int ladder wdtsleep t1sleep; do
	hex=$PWD/benches/programs_pic/$program.hex
	a=$theirs b=$ours
	case $program in *sleep) a=$theirs_asleep b=$ours_asleep ;; esac
	: >"$out/a" && : >"$out/b"
	for _ in $(seq "$rounds"); do
		gpsim_run "$hex" "$a" >>"$out/a"
		if [ -z "$only" ]; then "$speed" "$hex" "$b" >>"$out/b"; fi
	done
	a=$(best <"$out/a") b=$(best <"$out/b")
	printf '%-9s %10s %12s %8s\n' "$program" "$a" "$b" "$(echo "$b $a" | awk '{ printf "%.1f", $1 / $2 }')"
done
