; chip: pic16f877
; The configuration by its settings.
        list    p=16f877
        CONFIG FOSC=XT
        CONFIG WDTE=OFF, PWRTE=ON, LVP=OFF
        nop
        end
