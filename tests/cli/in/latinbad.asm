 list p=16f84a
 ; é
 dt "éé", ¿que?
 end
