# Reads sources as far as their look tells; shared by tidy_batches.awk, missing_includes.awk,
# missing_headers.awk and source_files.awk.

# Reads a source. Sets `names` to the names in its anonymous namespaces, `words` to every word in it and in the headers of the
# repository that it includes, `declared` to the names that stand at a margin there, and `unused` to those of its using-declarations
# and aliases that it does not mention again.
function read_names(source,    line, parts, seen, needed, n, i, word, name, inside) {
  split("", names)
  split("", words)
  split("", declared)
  split("", unused)
  split("", included)
  while ((getline line < (root source)) > 0) {
    if (line ~ /^namespace {$/) inside++
    if (line ~ /^}  \/\/ namespace$/) inside--
    n = split(line, parts, /[^A-Za-z0-9_]+/)
    for (i = 1; i <= n; i++) seen[parts[i]]++
    if (line ~ /^ *using [A-Za-z0-9_:]+;/) needed[parts[n - 1]]
    else if (line ~ /^ *namespace [A-Za-z0-9_]+ =/) needed[parts[line ~ /^ / ? 3 : 2]]
    if (inside || line ~ /^#/) {
      name = name_at_start(line)
      if (name != "") names[name]
    }
    n = split(constants_in(line), parts, " ")
    if (inside) for (i = 1; i <= n; i++) names[parts[i]]
  }
  close(root source)
  read_words(source)
  for (word in needed) if (seen[word] < 2) unused[word]
}

# Adds the words and declared names of a file and, once each, of the headers of the repository that it includes. `included` has
# all of these, and the system's headers as "<vector>".
function read_words(path,    line, parts, n, i, name) {
  if (path in included) return
  included[path]
  if (path ~ /^</) return
  if (!(path in words_of)) {
    split("", fresh)
    words_of[path] = headers_of[path] = declared_of[path] = ""
    while ((getline line < (root path)) > 0) {
      if (match(line, /^#include "[^"]*"/)) headers_of[path] = headers_of[path] " " substr(line, 11, RLENGTH - 11)
      else if (match(line, /^#include <[^>]*>/)) headers_of[path] = headers_of[path] " " substr(line, 10, RLENGTH - 9)
      if (line ~ /^#include ".*\.inl"/) words_of[path] = words_of[path] " " substr(line, 10)
      sub(/\/\/.*/, "", line)
      name = name_at_start(line)
      if (name != "") declared_of[path] = declared_of[path] " " name
      declared_of[path] = declared_of[path] constants_in(line)
      n = split(line, parts, /[^A-Za-z0-9_]+/)
      for (i = 1; i <= n; i++) {
        if (parts[i] in fresh) continue
        fresh[parts[i]]
        words_of[path] = words_of[path] " " parts[i]
      }
    }
    close(root path)
  }
  n = split(words_of[path], parts, " ")
  for (i = 1; i <= n; i++) words[parts[i]]
  n = split(declared_of[path], parts, " ")
  for (i = 1; i <= n; i++) declared[parts[i]]
  n = split(headers_of[path], parts, " ")
  for (i = 1; i <= n; i++) read_words(parts[i])
}

# The constants that a declaration introduces whose first line has no indentation, each after a blank; to be called with each of
# its lines.
function constants_in(line,    found, name) {
  if (line ~ /^(inline |static )*(constexpr|const|enum) /) constants_go_on = 1
  if (!constants_go_on) return ""
  constants_go_on = line !~ /[;{]$/
  while (match(line, /[ *&]k[A-Z][A-Za-z0-9_]*(\[[^]]*\])* ?[={(]/)) {
    name = substr(line, RSTART + 1, RLENGTH - 1)
    line = substr(line, RSTART + RLENGTH)
    sub(/[^A-Za-z0-9_].*/, "", name)
    found = found " " name
  }
  return found
}

# The name that a line without indentation introduces, as far as its look tells. What is included for its definitions counts as
# one, for it can be included but once.
function name_at_start(line) {
  if (line ~ /^#include ".*\.inl"/) return substr(line, 10)
  if (match(line, /^using [A-Za-z0-9_]+ =/)) return substr(line, 7, RLENGTH - 8)
  gsub(/alignas\([^)]*\) |\[\[[a-z]*\]\] /, "", line)
  if (sub(/^(class|struct|enum class|enum|#define) /, "", line)) {
    return match(line, /^[A-Za-z0-9_]+/) ? substr(line, 1, RLENGTH) : ""
  }
  if (line !~ /^[A-Za-z]/ || line ~ /^(namespace|static_assert|TEST)/ || !match(line, /[A-Za-z0-9_:]+ ?[=({;[]/)) return ""
  line = substr(line, RSTART, RLENGTH)
  gsub(/[^A-Za-z0-9_:]/, "", line)
  return line ~ /:/ ? "" : line  # a qualified name is declared elsewhere
}
