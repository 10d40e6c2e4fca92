#!/usr/bin/env bash
# Runs the same HEX files on s51 and on this emulator in the same minute and prints emulated million machine cycles per CPU second (user time) and the ratio.
#
# Usage: benches/speed51.sh [ROUNDS]   (needs sdcc-ucsim; builds with cargo). Every program runs ROUNDS times (3) on
# each side in turn; the best round of each side counts, because disturbances only slow a run down. s51 runs for 3 seconds of
# wall-clock time, and then reports its number of cycles.
set -euo pipefail
cd "$(dirname "$0")/.."
rounds=${1:-3}
seconds=3
ours=1000000000
idle=100000000000

cargo build --release --quiet --example speed51
target=$(cargo metadata --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
out=$target/peers/speed51
mkdir -p "$out"
speed=$target/release/examples/speed51
programs=$("$speed" hex "$out")

grep -m1 'model name' /proc/cpuinfo | sed 's/.*: //'
echo "s51 $(dpkg-query -W -f '${Version}' sdcc-ucsim 2>/dev/null || echo unknown): -t C52 -g"
echo "emu: release build, at89c52, all peripherals; million machine cycles/s, best of $rounds"
printf '%-6s %10s %12s %8s\n' program s51 emu ratio

# Best rate of the lines "cycles seconds .." on stdin, in millions per second.
best() { awk '{ r = $1 / $2 / 1e6; if (r > m) m = r } END { printf "%.1f", m }'; }

# "cycles seconds" of s51 on a HEX file; its state gives the clocks, 12 per machine cycle.
s51_run() {
	local clocks spent
	TIMEFORMAT=%U
	spent=$({ time { sleep "$seconds"; echo state; echo quit; } | s51 -t C52 -b -g "$1" >"$out/s51.txt" 2>/dev/null; } 2>&1)
	clocks=$(sed -n 's/^Total time since last reset=.*(\([0-9]*\) clks).*/\1/p' "$out/s51.txt")
	echo "$((clocks / 12)) $spent"
}

for program in $programs; do
	hex=$out/$program.hex
	cycles=$ours
	if [ "$program" = idle ]; then cycles=$idle; fi
	: >"$out/a" && : >"$out/b"
	for _ in $(seq "$rounds"); do
		s51_run "$hex" >>"$out/a"
		"$speed" run "$hex" "$cycles" >>"$out/b"
	done
	a=$(best <"$out/a") b=$(best <"$out/b")
	printf '%-6s %10s %12s %8s\n' "$program" "$a" "$b" "$(echo "$b $a" | awk '{ printf "%.1f", $1 / $2 }')"
done
