; chip: pic16f88
; The configuration by its settings.
        list    p=16f88
        CONFIG FOSC = HS, WDTE=OFF
        config cp=on, BOREN = off
        CONFIG IESO = OFF
        nop
        end
