set pagination off
set confirm off
set width 0
set style enabled off
echo == load\n
load
echo == registers\n
info registers r0 r28 SREG SP pc
x/3i $pc
echo == memories\n
print greeting
print kept
x/4xb 0x810000
x/2xh 0
echo == a breakpoint on a function\n
break square
continue
backtrace
info frame
print n
print table
print &table
print/x $SP
echo == finish\n
finish
next
next
echo == where from\n
continue
up
info locals
up
info locals
frame 0
echo == a breakpoint on a line, with a condition\n
delete
tbreak program.c:28 if n == 3
continue
print n
print total
echo == watch\n
watch total
continue
continue
echo == backwards\n
reverse-continue
print total
reverse-continue
reverse-continue
print total
delete
echo == step, stepi, next\n
break main
monitor reset
maintenance flush register-cache
continue
next
stepi
nexti
next
next
step
step
step
backtrace
reverse-stepi
stepi
reverse-finish
reverse-step
reverse-next
echo == reads\n
delete
rwatch table[2]
continue
delete
awatch ticks
continue
continue
backtrace
echo == a variable in a register: gdb steps and looks\n
delete
monitor reset
maintenance flush register-cache
break add
continue
tbreak main
watch $r24
continue
continue
echo == set\n
delete
break add
continue
set var n = 9
set var table[3] = 7
finish
print total
echo == monitor\n
monitor halt
monitor cycle
monitor why
delete
echo == its end\n
continue
next
monitor why
detach
