# Finds constants and types of a source's anonymous namespace that have the name of one in a header of the same or an
# enclosing namespace. Merged with another source (TESSERA_MERGE), such a name silently hides the header's from it. Finds types
# that two headers of one namespace define, too: no program may have both.
#
#   awk -f hidden_names.awk HEADER... SOURCE...        all headers first; prints a line for each, and exits with 1 if there is one

# The names that a line at file scope gives to constants or a type, each between blanks.
function named(line,   names) {
  if (line ~ /^(inline |static )*(constexpr|const) /) {
    names = " "
    while (match(line, /[ *&]k[A-Z][A-Za-z0-9_]*[ ]*(\[[^]]*\])*[ ]*[={(]/)) {
      names = names name_in(substr(line, RSTART + 1, RLENGTH - 1)) " "
      line = substr(line, RSTART + RLENGTH)
    }
    return names
  }
  if (line ~ /^(struct|class|enum|enum class) [^;]*$/) {
    sub(/^(enum class|enum|struct|class) +(alignas\([^)]*\) +)?/, "", line)
    return " " name_in(line) " "
  }
  return " "
}

function name_in(text) {
  sub(/[^A-Za-z0-9_].*/, "", text)
  return text
}

# Sources that say "using namespace" of a nested one look for its names in the one around it, too.
BEGIN {
  for (i = 1; i < ARGC; ++i) {
    outer_space = ""
    while ((getline line < ARGV[i]) > 0) {
      if (line ~ /^namespace [A-Za-z0-9_:]+ \{/ && outer_space == "") {
        outer_space = line
        sub(/^namespace /, "", outer_space)
        sub(/ .*/, "", outer_space)
      }
      if (ARGV[i] !~ /_test\.cpp$/ && line ~ /^using namespace [a-z_]+;/) {
        sub(/^using namespace /, "", line)
        sub(/;.*/, "", line)
        used[outer_space "::" line] = outer_space
      }
    }
    close(ARGV[i])
  }
}
FNR == 1 { space = ""; anonymous = 0; header = FILENAME ~ /\.h$/ }
/^namespace [A-Za-z0-9_:]+ \{/ && space == "" { space = $2 }
/^namespace \{/ { anonymous = 1 }
/^\}  \/\/ namespace$/ { anonymous = 0 }
(header && space != "") || anonymous {
  count = split(named($0), name, " ")
  for (i = 1; i <= count; ++i) {
    if (header) {
      if (/\{/ && !/::/ && !/ k[A-Z]/) {
        if ((space, name[i]) in defined && defined[space, name[i]] != FILENAME) {
          printf "%s:%d: %s is another type in %s\n", FILENAME, FNR, name[i], defined[space, name[i]]
          found = 1
        }
        defined[space, name[i]] = FILENAME
      }
      declared[space, name[i]] = FILENAME
      if (space in used) declared[used[space], name[i]] = FILENAME
      continue
    }
    for (outer = space; outer != ""; sub(/(::)?[A-Za-z0-9_]+$/, "", outer)) {
      if (!((outer, name[i]) in declared)) continue
      printf "%s:%d: %s hides that of %s where sources are merged\n", FILENAME, FNR, name[i], declared[outer, name[i]]
      found = 1
    }
  }
}
END { exit found }
