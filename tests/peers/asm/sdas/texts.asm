; chip: 8052
; Texts with any delimiter, escapes, characters as numbers.
        .module texts
        .area   CSEG (CODE)
        .ascii  "a\\b\q\x41\e"
        .ascii  ^\n\b\t\r\f^
        .ascii  |\101\0\18\400|
        .ascii  /a;b/ ; a comment
        .asciz  'it"s'
        .ascis  "ab"
        .strs   /a\n/
        .fcc    ~it's~
        .strz   "ab\"
        .db     'a, 'Z, ' , '0, 'a'
        .db     '\n, '\, '', ';, 'x'   ; don't
        .db     #1, #(2+3), #'c, 'a-'b, '(+1
        .db     "ab, "xy", 'b+1
        .dw     "ab, "\n", 'a
        .fcb    "ab, 'a, '\n', #5
        .fdb    'a', "xy"
        mov     a,#'A ; it's A
        mov     a,#'A'
        mov     a,#';
        mov     dptr,#"xy
        cjne    a,#',,.
        cjne    a,#'',.
