#!/bin/sh
# Runs the same HEX files on simavr and on this emulator in the same minute and prints emulated Mcycles per CPU second and the ratio, then
# the time of a clone of the whole machine.
#
# Usage: benches/speed.sh [ROUNDS]   (needs cc, libsimavr-dev, libelf-dev; builds with cargo). Every program runs ROUNDS times
# (3) on each side in turn; the best round of each side counts, because disturbances only slow a run down.
# EMU_SIMAVR=FOLDER adds another simavr: the folder with sim/ and a built library (`make RELEASE=1 libsimavr`).
set -eu
cd "$(dirname "$0")/.."
rounds=${1:-3}
other=${EMU_SIMAVR:-}
theirs=100000000
ours=400000000
# Asleep.
theirs_asleep=10000000000
ours_asleep=1000000000000
limit=100000

cargo build --release --quiet --example speed
target=$(cargo metadata --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
out=$target/peers
tests/peers/build.sh "$out"
speed=$target/release/examples/speed
programs=$("$speed" hex "$out")
if [ -n "$other" ]; then
	mkdir -p "$out/include"
	ln -sfn "$(cd "$other/sim" && pwd)" "$out/include/simavr"
	library=$(find "$other" -name libsimavr.a | head -n 1)
	cc -std=gnu11 -O2 -I"$out/include" -I"$out/include/simavr" -I"$other" -o "$out/simavr_other" tests/peers/simavr_speed.c \
		"$library" -lelf -lm -lutil
fi

grep -m1 'model name' /proc/cpuinfo | sed 's/.*: //'
rustc --version
echo "simavr $(dpkg-query -W -f '${Version}' libsimavr2 2>/dev/null || echo unknown): library, atmega328p at 16 MHz, sleep without waiting; run_cycle_limit as it comes and set to $limit"
[ -z "$other" ] || echo "other: simavr of EMU_SIMAVR, the same with run_cycle_limit $limit"
echo "emu: release build, atmega328p at 16 MHz, all peripherals, jumping over polling loops off"
echo "emulated Mcycles per second of CPU of one thread, best of $rounds"
printf '%-6s %10s %10s %10s %12s %8s %8s %8s\n' program simavr limit other emu ratio "limit" "other"

# Best rate of the lines "cycles seconds .." on stdin, in millions per second.
best() { awk '{ r = $1 / ($2 > 0 ? $2 : 1e-6) / 1e6; if (r > m) m = r } END { printf "%.1f", m }'; }
ratio() { echo "$1 $2" | awk '{ if ($2 > 0) printf "%.2f", $1 / $2; else printf "-" }'; }

for program in $programs; do
	hex=$out/$program.hex
	they=$theirs we=$ours
	[ "$program" != sleep ] || they=$theirs_asleep we=$ours_asleep
	: >"$out/a" && : >"$out/b" && : >"$out/c" && : >"$out/d"
	for _ in $(seq "$rounds"); do
		"$out/simavr_speed" "$hex" $they >>"$out/a" 2>/dev/null
		"$speed" run "$hex" $we >>"$out/c"
		"$out/simavr_speed" "$hex" $they $limit >>"$out/b" 2>/dev/null
		[ -z "$other" ] || "$out/simavr_other" "$hex" $they $limit 2>/dev/null | grep '^[0-9]' >>"$out/d"
	done
	a=$(best <"$out/a") b=$(best <"$out/b") c=$(best <"$out/c") d=$(best <"$out/d")
	printf '%-6s %10s %10s %10s %12s %8s %8s %8s\n' "$program" "$a" "$b" "$d" "$c" "$(ratio "$c" "$a")" "$(ratio "$c" "$b")" "$(ratio "$c" "$d")"
done
"$speed" clone "$out/irq.hex"
