echo from the script

print $cycle
