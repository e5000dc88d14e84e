# Makes plain comments those of Doxygen: of what follows at the beginning of a line, of what precedes behind it. Headings
# between parts of a header stay as they are.
/^\/\* ---/b
s/^( *)\/\* /\1\/** /
s/^(.*[;,{}A-Za-z0-9_] *)\/\* /\1\/**< /
s/([^:])#([0-9])/\1\\#\2/g
