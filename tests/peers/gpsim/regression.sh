#!/usr/bin/env bash
# Fetches the source package of gpsim and assembles those of its regression tests that are for chips of ours.
#
# Usage: tests/peers/gpsim/regression.sh DIR [CHIP ..]   (needs apt, gputils and the net)
#
# DIR/tests gets NAME.hex, NAME.cod and, where the test has commands of its own, NAME.stc; NAME is FOLDER.PROGRAM of gpsim's
# tree. DIR/list.txt gets a line `NAME CHIP` for each. Nothing is installed: apt works in DIR with settings of its own. What cannot
# be had is said, and is no failure. A source that lies in DIR already is not fetched again.
set -euo pipefail
dir=$1
shift
version=0.32.1
sum=c704d923ae771fabb7f63775a564dfefd7018a79c914671c4477854420b32e69
mirror=${GPSIM_MIRROR:-http://deb.debian.org/debian}
tar=gpsim_$version.orig.tar.gz

rm -rf "$dir/tests"
mkdir -p "$dir"/apt/{state/lists/partial,cache/archives/partial} "$dir/tests"
cd "$dir"
: >list.txt

whole() { [ -f "$tar" ] && echo "$sum  $tar" | sha256sum --check --status; }

fetch() {
	echo "deb-src $mirror trixie main" >apt/sources.list
	: >apt/status
	local set=(-o Dir::Etc::sourcelist="$PWD/apt/sources.list" -o Dir::Etc::sourceparts=/dev/null
		-o Dir::State="$PWD/apt/state" -o Dir::State::status="$PWD/apt/status" -o Dir::Cache="$PWD/apt/cache")
	apt-get "${set[@]}" -q update && apt-get "${set[@]}" -q source --download-only --tar-only gpsim
}

if ! whole; then
	said=$(fetch 2>&1) || true
	if ! whole; then
		echo "gpsim's regression tests are left out: its source $version cannot be fetched from $mirror (or is another one)."
		printf '%s\n' "$said" | tail -n 3
		exit 0
	fi
fi
if ! command -v gpasm >/dev/null || ! command -v gplink >/dev/null; then
	echo "gpsim's regression tests are left out: gpasm or gplink is missing (package gputils)."
	exit 0
fi
rm -rf source && mkdir source && tar -xzf "$tar" -C source --strip-components=1
cd source/regression

# The chip that a source file names, as `16f84`.
chip_of() {
	sed -nE 's/^\s*(list\s.*p\s*=|processor\s)\s*(pic)?(1[0-9a-z]+).*/\3/Ip' "$1" | head -n 1 | tr '[:upper:]' '[:lower:]'
}

for source in */*.asm; do
	folder=${source%/*}
	program=$(basename "$source" .asm)
	chip=$(chip_of "$source")
	case " $* " in *" pic$chip "*) ;; *) continue ;; esac
	name=$folder.$program
	# Sections may be named by a linker script beside the source.
	script=$(cd "$folder" && ls | grep -ixF -e "$program.lkr" -e "$chip.lkr" | head -n 1) || true
	if ! said=$(cd "$folder" && { gpasm -w 2 -c -o "$program.o" "$program.asm" &&
		gplink -w ${script:+-s "$script"} -o "$program.hex" "$program.o"; } 2>&1); then
		echo "$name: does not assemble: $(grep -im1 error <<<"$said" || true)"
		continue
	fi
	cp "$folder/$program.hex" "../../tests/$name.hex"
	cp "$folder/$program.cod" "../../tests/$name.cod"
	# Many a file of commands is a leftover; the makefile says which are used.
	if [ -f "$folder/$program.stc" ] && grep -qE "STC=\"?(\\\$\(STC\)|$program\.stc)" "$folder/Makefile"; then
		cp "$folder/$program.stc" "../../tests/$name.stc"
	fi
	echo "$name pic$chip" >>../../list.txt
done
