; comment of old editors: été
 list p=16f84a
 include "latin.inc"
 org 0
mañana dt "¿Aé"
 accent
 end
