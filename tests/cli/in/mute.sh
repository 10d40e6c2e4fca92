#!/bin/sh
# A simulator that takes commands and says nothing.
while read -r _; do :; done
