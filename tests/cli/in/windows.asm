; A source from Windows: names of files in any case, folders with backslashes, conditions by -D.
$INCLUDE (REGX52.INC)
$INCLUDE (.\PANEL51.inc)
        IF SPEED == 1
        DB 1
        ELSEIF SPEED == 2
        DB LAMPS
        ENDIF
        END
