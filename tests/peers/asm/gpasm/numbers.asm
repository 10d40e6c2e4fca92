; chip: pic16f877a
; Numbers in every form and radix, operators and their precedence, parts of numbers, the location counter.
        list    p=16f877a
        #include <p16f877a.inc>
        radix   hex
five    equ     5
Five    equ     50                      ; names keep their case, and this is hexadecimal
sum     =       five + Five * 2
moving  set     1
        movlw   10
        movlw   0x10
        movlw   0X1f
        movlw   10h
        movlw   0FFh
        movlw   0ffH
        movlw   0a
        movlw   1d
        movlw   1b
        movlw   0bb
        movlw   H'1F'
        movlw   h'1f'
        movlw   D'10'
        movlw   d'255'
        movlw   B'1010'
        movlw   b'11111111'
        movlw   O'17'
        movlw   o'377'
        movlw   Q'17'
        movlw   17o
        movlw   377Q
        movlw   .31
        movlw   .255
        movlw   A'c'
        movlw   a'c'
        movlw   'c'
        movlw   ';'
        movlw   "a"
        movlw   -1
        movlw   -80
        radix   dec
        movlw   10
        movlw   0x10
        movlw   10h
        movlw   0FFh
        movlw   1010b
        movlw   010
        movlw   17o
        movlw   99d
        movlw   B'101'
        radix   oct
        movlw   17
        movlw   .17
        movlw   0x17
        list    r=dec
        movlw   17
        list    R=HEX
        movlw   17
        list    r=dec, n=0
        movlw   five + five
        movlw   five*2+1
        movlw   1+five*2
        movlw   20-5-3
        movlw   100/5/2
        movlw   100/5*2
        movlw   7%4*2
        movlw   -8/3
        movlw   -7%4
        movlw   1+2&3
        movlw   3&1+2
        movlw   1|6*2
        movlw   6*2|1
        movlw   5^1|8
        movlw   8|5^1
        movlw   6&3^1
        movlw   1^6&3
        movlw   1|2^3&4
        movlw   1<<2+1
        movlw   1+1<<2
        movlw   0x80>>3
        movlw   0x80>>3&0x1F
        movlw   (1+2)*(3+4)
        movlw   ((((five))))
        movlw   ( 1 + 2 ) * 3
        movlw   -3+five
        movlw   -3*(-2)
        movlw   ~five
        movlw   !five
        movlw   !0
        movlw   -(five)
        movlw   3 == 3
        movlw   3 == 4
        movlw   3 != 4
        movlw   3 < 4
        movlw   3 > 4
        movlw   4 >= 4
        movlw   5 <= 4
        movlw   2 && 1
        movlw   0 && 1
        movlw   0 || 0
        movlw   4 || 0
        movlw   1&&0||1
        movlw   0||1&&0
        movlw   1 + 2 == 3
        movlw   1&3==3
        movlw   1<2==1
        movlw   2==1<2
        movlw   3 & 1 == 1
        movlw   low 0x1234
        movlw   high 0x1234
        movlw   upper 0x123456
        movlw   LOW 0x1234
        movlw   HIGH(0x1234)
        movlw   low(0x1234)+1
        movlw   high 0x12FF+1
        movlw   2*high 0x1234
        movlw   low finish
        movlw   high finish
        movlw   high (finish + 0x100)
        movlw   'A' + 1
        movlw   sum & 0xFF
        movlw   finish-start
        movlw   moving
moving  set     moving + 1
        movlw   moving
moving  set     moving * 4
        movlw   moving
start   goto    $
        goto    $+1
        goto    $ - 1
        goto    finish + 1
        call    start
        dw      $, $-start, finish, sum
        movlw   low $
        movf    five + 0x20, W
        bcf     0x20 + five, five
finish  return
        nop
        end
