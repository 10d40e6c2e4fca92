#!/bin/sh
# The same HEX files on simavr and on this emulator in the same minute: emulated Mcycles per second of CPU, and the ratio.
#
# Usage: tests/peers/speed.sh [ROUNDS]   (needs cc, libsimavr-dev, libelf-dev; builds with cargo). Every program runs ROUNDS
# times (3) on each side in turn; the best round of each side counts, since what disturbs a run only slows it down.
set -eu
cd "$(dirname "$0")/../.."
rounds=${1:-3}
theirs=100000000
ours=400000000
limit=100000

cargo build --release --quiet --example speed
target=$(cargo metadata --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
out=$target/peers
tests/peers/build.sh "$out"
speed=$target/release/examples/speed
programs=$("$speed" hex "$out")

version=$(dpkg-query -W -f '${Version}' libsimavr2 2>/dev/null || echo unknown)
grep -m1 'model name' /proc/cpuinfo | sed 's/.*: //'
echo "simavr $version: library, atmega328p, CPU time; run_cycle_limit as it comes and set to $limit"
echo "emu: release build, jumping over polling loops off; Mcycles/s, best of $rounds"
printf '%-6s %10s %10s %10s %8s %8s\n' program simavr "limit" emu ratio "to limit"

# Best rate of the lines "cycles seconds .." on stdin, in millions a second.
best() { awk '{ r = $1 / $2 / 1e6; if (r > m) m = r } END { printf "%.1f", m }'; }

for program in $programs; do
	hex=$out/$program.hex
	: >"$out/a" && : >"$out/b" && : >"$out/c"
	for _ in $(seq "$rounds"); do
		"$out/simavr_speed" "$hex" $theirs >>"$out/a" 2>/dev/null
		"$speed" run "$hex" $ours >>"$out/c"
		"$out/simavr_speed" "$hex" $theirs $limit >>"$out/b" 2>/dev/null
	done
	a=$(best <"$out/a") b=$(best <"$out/b") c=$(best <"$out/c")
	printf '%-6s %10s %10s %10s %8s %8s\n' "$program" "$a" "$b" "$c" \
		"$(echo "$c $a" | awk '{ printf "%.2f", $1 / $2 }')" "$(echo "$c $b" | awk '{ printf "%.2f", $1 / $2 }')"
done
