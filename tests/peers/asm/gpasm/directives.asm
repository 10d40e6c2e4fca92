; chip: pic16f873
; Data in all its forms, space, blocks of constants, banks and pages, the words outside of the program.
        title   "Directives"
        subtitle "of all kinds"
        list    p=PIC16F873, n=60, c=132, st=off
        #include <p16f873.inc>
        errorlevel -302, -303
        __CONFIG _XT_OSC & _WDT_OFF & _PWRTE_ON & _CP_OFF & _LVP_OFF
        __IDLOCS 1234
        #define ROOM 2
        cblock  20
        first, second
        array:ROOM, behind
        pair:2, third
        wide:4
        last
        endc
        cblock                          ; goes on
        more
        none:0, same
        endc
        CBLOCK 0x70
saved:1
status_saved
        ENDC
        constant seven=7, eight = 8
        variable count=3
        org     0
        goto    main
        org     4
        retfie
        nolist
        org     10
main    movlw   first
        movlw   second
        movlw   pair
        movlw   third
        movlw   wide
        movlw   last
        movlw   more
        movlw   none
        movlw   same
        movlw   saved
        movlw   status_saved
        movlw   seven
        movlw   eight
        movlw   count
        list
        page
        space   2
        banksel TRISA
        movwf   TRISA
        BANKSEL PORTA
        banksel 0x120
        banksel 0x1A0
        banksel last
        bankisel 0x20
        bankisel 0x120
        pagesel far
        call    far
        pagesel main
        addwf   PCL, F
table   dt      1, 2, "abc", 'd', .31, 0
        retlw   0
words   dw      1, 3FFF, main, table-main
        data    5, 6
        DW      "ab", 7
bytes   db      1, 2, 3
        db      "pq", 4
        db      1
packed  da      "abc", "de", 123
        de      1, 2, "xy"
        fill    3FFF, 2
        fill    (nop), 2
        fill    (goto $), 2
        fill    seven, 1
gap     res     2
        nop
here    org     $ + 5
        goto    here
label1
label2: nop
label3: goto    label1
label4  goto    label2
        org     0x800
far     return
        org     2100
        de      1, 2, "hello", 0
        de      0FF
        dw      7
        end
