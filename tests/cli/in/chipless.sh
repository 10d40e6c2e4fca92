#!/bin/sh
# Says what gpsim 0.31 says to a chip that it does not know: each complaint in lines of its own.
while read -r line; do
    case $line in
        load*) echo "**gpsim> $line"; echo "p16f872 is not a valid processor." ;;
        cycles) echo "0 = 0x00000000" ;;
        *) echo "***ERROR: syntax error, unexpected EOLN_T, expecting MACRO while parsing:"; echo "	'$line'" ;;
    esac
done
