# Decides whether sources can be compiled as one; shared by tidy_batches.awk and merge_sources.awk. No name that a source keeps to
# itself in an anonymous namespace may be mentioned by another source of its group or by a header that the other includes.

# Reads a source. Sets `names` to the names in its anonymous namespaces, `words` to every word in it and in the headers of the
# repository that it includes, `line_count` to its length, and `alone` if it has a using-declaration or an alias without a use.
function read_names(source,    line, parts, seen, needed, n, i, word, name, inside) {
  split("", names)
  split("", words)
  split("", included)
  alone = line_count = 0
  while ((getline line < (root source)) > 0) {
    line_count++
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
  }
  close(root source)
  read_words(source)
  for (word in needed) if (seen[word] < 2) alone = 1
}

# Adds the words of a file and, once each, of the headers of the repository that it includes. `included` has all of these, and
# the system's headers as "<vector>".
function read_words(path,    line, parts, n, i) {
  if (path in included) return
  included[path]
  if (path ~ /^</) return
  if (!(path in words_of)) {
    split("", fresh)
    words_of[path] = headers_of[path] = ""
    while ((getline line < (root path)) > 0) {
      if (match(line, /^#include "[^"]*"/)) headers_of[path] = headers_of[path] " " substr(line, 11, RLENGTH - 11)
      else if (match(line, /^#include <[^>]*>/)) headers_of[path] = headers_of[path] " " substr(line, 10, RLENGTH - 9)
      if (line ~ /^#include ".*\.inl"/) words_of[path] = words_of[path] " " substr(line, 10)
      sub(/\/\/.*/, "", line)
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
  n = split(headers_of[path], parts, " ")
  for (i = 1; i <= n; i++) read_words(parts[i])
}

# The name that a line without indentation introduces, as far as its look tells. What is included for its definitions counts as
# one, for it can be included but once.
function name_at_start(line) {
  if (line ~ /^#include ".*\.inl"/) return substr(line, 10)
  if (sub(/^(class|struct|enum class|enum|#define) /, "", line)) {
    return match(line, /^[A-Za-z0-9_]+/) ? substr(line, 1, RLENGTH) : ""
  }
  if (line !~ /^[A-Za-z]/ || line ~ /^(namespace|static_assert|TEST)/ || !match(line, /[A-Za-z0-9_:]+ ?[=({;[]/)) return ""
  line = substr(line, RSTART, RLENGTH)
  gsub(/[^A-Za-z0-9_:]/, "", line)
  return line ~ /:/ ? "" : line  # a qualified name is declared elsewhere
}

# Whether the source that was read last can join a group.
function fits(group,    name, n, i, parts) {
  for (name in names) if ((group, name) in mentioned) return 0
  n = split(named[group], parts, " ")
  for (i = 1; i <= n; i++) if (parts[i] in words) return 0
  return 1
}

function join(group,    name) {
  for (name in names) named[group] = named[group] " " name
  for (name in words) mentioned[group, name]
}
