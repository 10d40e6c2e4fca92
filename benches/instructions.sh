#!/bin/sh
# Counts the host's instructions that builds of emu need for one emulated cycle, on the programs of this folder. Other load does not change
# the counts, so that a change of a hot loop shows in the fourth digit.
#
# Usage: benches/instructions.sh EMU [EMU ...]   (needs valgrind)
# The last column is the last build's count relative to the first build's. Each program runs twice, LONG and SHORT cycles; the difference
# of both leaves out the start of the process.
set -eu
[ $# -gt 0 ] || { sed -n '5,7s/^# //p' "$0" >&2; exit 2; }
folder=$(cd "$(dirname "$0")" && pwd)
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
for newest; do :; done

# count EMU HEX CHIP CYCLES
count() {
	valgrind --tool=callgrind --callgrind-out-file=/dev/null "$1" run "$2" --mcu "$3" --cycles "$4" 2>&1 >/dev/null |
		sed -n 's/.*Collected : \([0-9]*\)$/\1/p'
}

# measure NAME HEX CHIP SHORT LONG EMU...
measure() {
	name=$1 hex=$2 chip=$3 short=$4 long=$5
	shift 5
	printf '%-11s %-9s' "$chip" "$name"
	first=
	for emu; do
		per_cycle=$(echo "$(count "$emu" "$hex" "$chip" "$long") $(count "$emu" "$hex" "$chip" "$short")" |
			awk -v n=$((long - short)) '{ printf "%.6g", ($1 - $2) / n }')
		first=${first:-$per_cycle}
		printf ' %12s' "$per_cycle"
	done
	echo "$first $per_cycle" | awk '{ printf " %+8.2f %%\n", ($2 / $1 - 1) * 100 }'
}

printf '%-11s %-9s' chip program
n=0
for emu; do
	n=$((n + 1))
	printf ' %12s' "build $n"
done
echo '    change'
for source in "$folder"/programs/*.s "$folder"/programs/*.ld "$folder"/programs51/*.s "$folder"/programs_pic/*.hex; do
	name=$(basename "${source%.*}")
	hex=$out/$name.hex
	case $source in
	*/programs51/*) chip=at89c52 ;;
	*/programs_pic/*) chip=pic16f873 ;;
	*) chip=atmega328p ;;
	esac
	case $source in
	*.s) "$newest" asm "$source" --mcu $chip -o "$hex" >/dev/null 2>&1 ;;
	*.ld) "$newest" compile "$source" --mcu $chip -o "$hex" >/dev/null 2>&1 ;;
	*.hex) cp "$source" "$hex" ;;
	esac
	case $name in
	*sleep | idle | poll) measure "$name" "$hex" $chip 100000000 1100000000 "$@" ;;
	*) measure "$name" "$hex" $chip 1000000 5000000 "$@" ;;
	esac
done
"$newest" asm "$folder/programs_ap101/count.asm" --mcu ap101 -o "$out/count.hex" >/dev/null
measure count "$out/count.hex" ap101 1000000 5000000 "$@"
