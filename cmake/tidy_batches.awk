# What clang-tidy is to check as one: most of its time goes into headers, and many sources include the same ones.
#
#   printf '%s\n' net/door.cpp net/channel.cpp | awk -v root=/repo/ -f cmake/tidy_batches.awk build/dev/compile_commands.json -
#
# For the sources on the standard input, paths from `root`, it prints lines "flags<TAB>source<TAB>source...": up to 32 sources
# and the compiler flags of all of them. What one of a batch says for itself in an anonymous namespace is mentioned by no other,
# nor by a header that another includes; most of what could not stand together is so kept apart. A source with a
# using-declaration or an alias that it seems not to need stands alone, for another source of its batch might use it.

FNR == 1 { input++ }

# compile_commands.json, as CMake writes it.
input == 1 && match($0, /^  "command": "/) {
  flags = substr($0, RLENGTH + 1)
  sub(/ -o .*/, "", flags)
  sub(/^[^-]* -/, "-", flags)
  gsub(/-isystem /, "-isystem", flags)
  gsub(/-Winvalid-pch|-fpch-preprocess|-include [^ ]*/, "", flags)  # what gcc precompiled is not for clang
  gsub(/\\\\/, "\001", flags)
  gsub(/\\/, "", flags)
  gsub(/\001/, "\\", flags)
}
input == 1 && match($0, /^  "file": "/) { flags_of[substr($0, RLENGTH + 1, length($0) - RLENGTH - 1)] = flags }

input == 2 {
  read_names($0)
  place($0)
}

END { for (batch = 1; batch <= batches; batch++) print flags_in[batch] list[batch] }

# Fills `names`, `words` and `alone` from a source: what it says in anonymous namespaces for itself, and whatever it and the
# headers of the repository that it includes mention.
function read_names(source,    line, parts, seen, needed, n, i, word, name, inside) {
  split("", names)
  split("", words)
  split("", included)
  alone = 0
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
    read_words(line)
  }
  close(root source)
  for (word in needed) if (seen[word] < 2) alone = 1
}

function read_words(line,    parts, n, i, path) {
  if (match(line, /^#include "[^"]*\.h"/)) {
    path = substr(line, 11, RLENGTH - 11)
    if (path in included) return
    included[path]
    while ((getline line < (root path)) > 0) read_words(line)
    close(root path)
    return
  }
  if (line ~ /^#include ".*\.inl"/) words[substr(line, 10)]
  sub(/\/\/.*/, "", line)
  n = split(line, parts, /[^A-Za-z0-9_]+/)
  for (i = 1; i <= n; i++) words[parts[i]]
}

# The name that a line without indentation introduces, as far as its look tells. What is included for its definitions counts as
# one, for it can be included but once.
function name_at_start(line) {
  if (line ~ /^#include ".*\.inl"/) return substr(line, 10)
  if (sub(/^(class|struct|enum class|enum|#define) /, "", line)) {
    return match(line, /^[A-Za-z0-9_]+/) ? substr(line, 1, RLENGTH) : ""
  }
  if (line !~ /^[A-Za-z]/ || line ~ /^(namespace|TEST)/ || !match(line, /[A-Za-z0-9_:]+ ?[=({;[]/)) return ""
  line = substr(line, RSTART, RLENGTH)
  gsub(/[^A-Za-z0-9_:]/, "", line)
  return line ~ /:/ ? "" : line  # what is qualified is declared elsewhere
}

function place(source,    batch, n, i, flags, name) {
  for (batch = 1; batch <= batches; batch++) if (!alone && !closed[batch] && size[batch] < 32 && fits(batch)) break
  if (batch > batches) {
    batches = batch
    closed[batch] = alone
  }
  size[batch]++
  list[batch] = list[batch] "\t" source
  for (name in names) named[batch] = named[batch] " " name
  for (name in words) mentioned[batch, name]
  n = split(flags_of[root source], flags, " ")
  for (i = 1; i <= n; i++) {
    if ((batch, flags[i]) in flagged) continue
    flagged[batch, flags[i]]
    flags_in[batch] = flags_in[batch] flags[i] " "
  }
}

function fits(batch,    name, n, i, parts) {
  for (name in names) if ((batch, name) in mentioned) return 0
  n = split(named[batch], parts, " ")
  for (i = 1; i <= n; i++) if (parts[i] in words) return 0
  return 1
}
