#!/bin/sh
# Loads a program as gpsim does, and fails to step.
while read -r line; do
    case $line in
        pc) echo "pc = 0x0" ;;
        W) echo "W = 0x0" ;;
        cycles) echo "0 = 0x00000000" ;;
        step*) echo "***ERROR: nothing to step" ;;
    esac
done
