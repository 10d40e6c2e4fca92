; chip: pic16f628a
; reports: 203 301
; Macros, repeats, conditions, texts that stand for others, files.
        processor 16f628a
        include "p16f628a.inc"
        radix   dec
        errorlevel -302
#define LED     PORTA,0
#define KEY     PORTB,RB7
#define TURBO
#define COUNT   5
#define twice(x) ((x)*2)
#define sum(x,y) x+y
#define chain   COUNT
#DEFINE UPPER   1
        #define indented 6
#define text    "hi"
later   equ     1
        org     0
        goto    start
        include "tick.inc"
load    macro   reg, value
        movlw   value
        movwf   reg
        endm
wait    macro   n
        local   again
        movlw   n
again   addlw   -1
        btfss   STATUS, Z
        goto    again
        endm
steps   macro   n
        if      n
        movlw   n
        steps   n-1
        else
        exitm
        endif
        nop
        endm
both    macro   first, second
        load    first, 1
        load    second, 2
        endm
mark    macro   n
spot#v(n)
        nop
        endm
toggle  macro   port, bit
        movlw   1 << bit
        xorwf   port, F
        endm
scratch macro   n
        local   k = 5
        movlw   k + n
        endm
start   load    0x20, 0x55
        load    0x21, COUNT + 1
        wait    10
        wait    20
        steps   3
        both    0x22, 0x23
        mark    1
        mark    1+1
        goto    spot1
        goto    spot2
        toggle  LED
        scratch 1
        scratch 2
        bsf     LED
        bcf     LED             ; LED
        BTFSS   KEY
        movlw   COUNT
        movlw   COUNT*2
        movlw   twice(3)
        movlw   twice(1+2)
        movlw   sum(3,4)
        movlw   chain
        movlw   UPPER
        movlw   indented
        dt      text
#undefine COUNT
#define COUNT   9
        movlw   COUNT
        if      1
        movlw   1
        else
        movlw   2
        endif
        if      1 == 2
        if      1
        movlw   3
        endif
        movlw   4
        else
        if      later
        movlw   5
        endif
        endif
        IF      UPPER
        movlw   6
        ENDIF
        ifdef   TURBO
        movlw   7
        else
        movlw   8
        endif
        ifndef  TURBO
        movlw   9
        else
        movlw   10
        endif
#ifdef  nothing
        movlw   11
#else
        movlw   12
#endif
        ifdef   STATUS
        movlw   13
        endif
        variable i = 0, j
        while   i < 3
        movlw   i
i       ++
        endw
i       =       3
        while   i
        movlw   i
i       -=      1
        endw
i       set     6
i       +=      2
        movlw   i
i       *=      3
        movlw   i
i       /=      4
        movlw   i
i       <<=     3
        movlw   i
i       >>=     1
        movlw   i
i       |=      3
        movlw   i
i       &=      6
        movlw   i
i       ^=      5
        movlw   i
i       %=      2
        movlw   i
i++
        movlw   i
i--
        movlw   i
j       set     i
        movlw   j
movlw   1
entry   wait    2
        goto    entry
        messg   "all is well"
        end
