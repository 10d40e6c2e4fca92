#!/bin/sh
# Ends in the middle of an answer.
read -r line
echo "**gpsim> $line"
