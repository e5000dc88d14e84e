# What clang-tidy is to check as one: most of its time goes into headers, and many sources include the same ones.
#
#   printf '%s\n' net/door.cpp net/channel.cpp | awk -v root=/repo/ -f cmake/tidy_batches.awk build/dev/compile_commands.json -
#
# For the sources on the standard input, paths from `root`, it prints lines "flags<TAB>source<TAB>source...": up to 12 sources and
# the compiler flags of all of them. No two of a batch say the same name at the start of a line; most of what could not stand
# together is so kept apart. A source with a using-declaration or an alias that it seems not to need stands alone, for another
# source of its batch might use it.

FNR == 1 { input++ }

# compile_commands.json, as CMake writes it.
input == 1 && match($0, /^  "command": "/) {
  flags = substr($0, RLENGTH + 1)
  sub(/ -o .*/, "", flags)
  sub(/^[^-]* -/, "-", flags)
  gsub(/-isystem /, "-isystem", flags)
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

# Fills `names` and `alone` from a source.
function read_names(source,    line, words, seen, needed, n, i, word, name) {
  split("", names)
  alone = 0
  while ((getline line < (root source)) > 0) {
    n = split(line, words, /[^A-Za-z0-9_]+/)
    for (i = 1; i <= n; i++) seen[words[i]]++
    if (line ~ /^ *using [A-Za-z0-9_:]+;/) needed[words[n - 1]]
    else if (line ~ /^ *namespace [A-Za-z0-9_]+ =/) needed[words[line ~ /^ / ? 3 : 2]]
    name = name_at_start(line)
    if (name != "") names[name]
  }
  close(root source)
  for (word in needed) if (seen[word] < 2) alone = 1
}

# The name that a line without indentation introduces, as far as its look tells. What is included for its definitions counts as
# one, for it can be included but once.
function name_at_start(line) {
  if (line ~ /^#include ".*\.inl"/) return line
  if (sub(/^(class|struct|enum class|enum|#define) /, "", line)) {
    return match(line, /^[A-Za-z0-9_]+/) ? substr(line, 1, RLENGTH) : ""
  }
  if (line !~ /^[A-Za-z]/ || line ~ /^(namespace|TEST)/ || !match(line, /[A-Za-z0-9_:]+ ?[=({;[]/)) return ""
  line = substr(line, RSTART, RLENGTH)
  gsub(/[^A-Za-z0-9_:]/, "", line)
  return line ~ /:/ ? "" : line  # what is qualified is declared elsewhere
}

function place(source,    batch, n, i, words, name) {
  for (batch = 1; batch <= batches; batch++) if (!alone && !closed[batch] && size[batch] < 12 && fits(batch)) break
  if (batch > batches) {
    batches = batch
    closed[batch] = alone
  }
  size[batch]++
  list[batch] = list[batch] "\t" source
  for (name in names) named[batch, name]
  n = split(flags_of[root source], words, " ")
  for (i = 1; i <= n; i++) {
    if ((batch, words[i]) in flagged) continue
    flagged[batch, words[i]]
    flags_in[batch] = flags_in[batch] words[i] " "
  }
}

function fits(batch,    name) {
  for (name in names) if ((batch, name) in named) return 0
  return 1
}
