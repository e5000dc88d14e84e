# Finds files that use a function, a type or a constant of one of our own headers which they do not include, themselves or by
# another header. Where sources are merged, a neighbour's includes hide that.
#
#   awk -f cmake/source_names.awk -f cmake/missing_headers.awk HEADER... SOURCE...
#
# All headers come first. Prints a line for each fault, and exits with 1 if there is one.
#
# A name counts as used where it can mean nothing else: it stands in the header's namespace or behind its last part, is no member of
# something, is not declared in the file itself, and is mentioned by no header that the file includes.

# The name that a line at file scope declares, if it is that of a type or of a function.
function declared_by(line) {
  sub(/^template <[^>]*> */, "", line)
  if (line ~ /^(struct|class|enum|enum class) [A-Z][A-Za-z0-9_]*( final)?( : .*)? *(\{|$)/) {
    sub(/^(enum class|enum|struct|class) /, "", line)
    sub(/[^A-Za-z0-9_].*/, "", line)
    return line
  }
  if (line !~ /^[A-Za-z]/ || line ~ /^(using|typedef|friend|static_assert|extern|return|namespace|struct|class|enum|explicit) /) return ""
  if (!match(line, /^[A-Za-z0-9_:<>,*& ]+[ *&][A-Z][A-Za-z0-9_]*\(/)) return ""
  line = substr(line, RSTART, RLENGTH - 1)
  sub(/.*[ *&]/, "", line)
  return line
}

# Notes that the current header declares the name.
function declare(name) {
  if (name == "" || (FILENAME, name) in space_in) return
  space_in[FILENAME, name] = space
  declarers[name] = declarers[name] " " FILENAME
}

# The line without what is no code. `block` and `raw` say what goes on in the next line.
function code_of(line,   at) {
  if (raw != "") {
    at = index(line, raw)
    if (at == 0) return ""
    line = substr(line, at + length(raw))
    raw = ""
  }
  if (block) {
    at = index(line, "*/")
    if (at == 0) return ""
    line = substr(line, at + 2)
    block = 0
  }
  gsub(/\\./, "", line)
  gsub(/'"'/, "", line)
  if (match(line, /R"[A-Za-z]*\(/)) {
    raw = ")" substr(line, RSTART + 2, RLENGTH - 3) "\""
    at = index(substr(line, RSTART + RLENGTH), raw)
    line = substr(line, 1, RSTART - 1)
    if (at != 0) raw = ""  # code behind it is passed over
  }
  gsub(/"[^"]*"/, "", line)
  sub(/\/\/.*/, "", line)
  gsub(/\/\*[^*]*\*\//, "", line)
  if ((at = index(line, "/*")) != 0) {
    line = substr(line, 1, at - 1)
    block = 1
  }
  return line
}

# Notes what the current file mentions, and each name by itself, or behind a part of a namespace.
function note(line,   name, before, space_of) {
  while (match(line, /[A-Za-z_][A-Za-z0-9_]*/)) {
    name = substr(line, RSTART, RLENGTH)
    before = tail substr(line, 1, RSTART - 1)
    tail = substr(before name, length(before name) > 60 ? length(before name) - 60 : 1)
    line = substr(line, RSTART + RLENGTH)
    if (header) mentions[FILENAME, name]
    if (name !~ /^k?[A-Z]/ || length(name) < 3) continue
    if (before ~ /(\.|->|~) *$/) continue
    if (before ~ /::$/) {
      space_of = substr(before, 1, length(before) - 2)
      sub(/.*[^A-Za-z0-9_]/, "", space_of)
      if (space_of != "") uses[FILENAME] = uses[FILENAME] " " name ":" space_of ":" FNR
      continue
    }
    if (before ~ /(struct|class|enum|using|typename|define|namespace) +$/ ||
        (before ~ /[A-Za-z0-9_>][*&]* +$/ && before !~ /(^|[^A-Za-z0-9_])(return|else|case|new|throw|const|constexpr|static|inline|public|private|virtual|explicit|friend|mutable|in|and|or|not|delete) +$/)) {
      own[FILENAME, name]
      continue
    }
    if (!((FILENAME, name) in noted)) {
      noted[FILENAME, name]
      uses[FILENAME] = uses[FILENAME] " " name "::" FNR
    }
  }
  tail = ""
}

# Whether `file` or a header that it includes mentions the name.
function reaches(file, name,   parts, count, i) {
  if (file in passed) return 0
  passed[file]
  if ((file, name) in mentions) return 1
  count = split(includes[file], parts, " ")
  for (i = 1; i <= count; i++) if (reaches(parts[i], name)) return 1
  return 0
}

function check(file,   parts, part, heads, count, heads_count, i, j, name, behind, space, inner) {
  count = split(uses[file], parts, " ")
  for (i = 1; i <= count; i++) {
    split(parts[i], part, ":")
    name = part[1]
    behind = part[2]
    if (!(name in declarers) || (file, name) in own || (file, name, behind) in reported) continue
    heads_count = split(declarers[name], heads, " ")
    for (j = 1; j <= heads_count; j++) {
      if (heads[j] == file) break
      space = space_in[heads[j], name]
      inner = spaces[file]
      if (behind == "" ? index(inner " ", " " space "::") + index(inner " ", " " space " ") == 0 : space !~ ("(^|:)" behind "$")) continue
      split("", passed)
      passed[file]
      if (reaches_any(file, name)) break
      printf "%s:%d: %s is declared in %s, which is not included\n", file, part[3], name, heads[j]
      reported[file, name, behind]
      found = 1
      break
    }
  }
}

function reaches_any(file, name,   parts, count, i) {
  count = split(includes[file], parts, " ")
  for (i = 1; i <= count; i++) if (reaches(parts[i], name)) return 1
  return 0
}

FNR == 1 {
  file_count++
  sub(/^\.\//, "", FILENAME)
  files[file_count] = FILENAME
  header = FILENAME ~ /\.h$/
  space = raw = tail = ""
  block = anonymous = constants_go_on = in_enum = 0
}
match($0, /^#include "[^"]*"/) { includes[FILENAME] = includes[FILENAME] " " substr($0, 11, RLENGTH - 11) }
/^ *#/ { next }
{ code = code_of($0) }
code == "" { next }
code ~ /^namespace [A-Za-z0-9_:]+ \{/ {
  space = $2
  spaces[FILENAME] = spaces[FILENAME] " " space
  next
}
code ~ /^namespace \{/ { anonymous = 1 }
$0 ~ /^\}  \/\/ namespace$/ { anonymous = 0 }
header && space ~ /^tessera/ && !anonymous {
  declare(declared_by(code))
  constant_count = split(constants_in(code), constants, " ")
  for (i = 1; i <= constant_count; i++) declare(constants[i])
}
code ~ /(^| )enum / { in_enum = 1 }
in_enum {
  rest = code
  while (match(rest, /k[A-Z][A-Za-z0-9_]*/)) {
    own[FILENAME, substr(rest, RSTART, RLENGTH)]
    rest = substr(rest, RSTART + RLENGTH)
  }
  in_enum = code !~ /[};]/
}
{ note(code) }
END {
  for (i = 1; i <= file_count; i++) check(files[i])
  exit found
}
