; Sleeps three times for the time of the watchdog.
 list p=16f84
 __config 0x3ffd
 org 0
 bsf 3, 5
 movlw 0x08
 movwf 1
 bcf 3, 5
 clrf 0x24
again:
 incf 0x24, f
 sleep
 nop
 movlw 3
 subwf 0x24, w
 clrwdt
 btfss 3, 2
 goto again
end_of_it:
 goto end_of_it
