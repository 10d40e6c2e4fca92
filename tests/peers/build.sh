#!/bin/sh
# Builds the C programs around simavr's library into the folder given. Needs cc, libsimavr-dev and libelf-dev.
set -eu
out=$1
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$out"
for name in simavr_step simavr_speed simavr_uart simavr_program; do
	# The headers of simavr's parts include those of the library without their folder.
	cc -std=gnu11 -O2 -Wall -Wextra -isystem /usr/include/simavr -o "$out/$name" "$here/$name.c" \
		-l:libsimavrparts.a -lsimavr -lelf
done
