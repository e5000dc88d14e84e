# Decides what clang-tidy checks as one: most of its time goes into headers, and many sources include the same ones.
#
#   printf '%s\n' net/door.cpp net/channel.cpp | awk -v root=/repo/ -f cmake/source_names.awk -f cmake/tidy_batches.awk \
#     build/dev/compile_commands.json -
#
# For the sources on the standard input, paths from `root`, it prints lines "flags<TAB>source<TAB>source...": up to 32 sources
# of one language standard, and the compiler flags of all of them. No name that a source keeps to itself in an anonymous
# namespace is declared by another source of its batch or by a header that the other includes, and no other mentions what a source
# declares to use and seems not to need, for that would be its use. The look of a line can mislead: then the batch does not
# compile, and ./dev halves it.

FNR == 1 { input++ }

# compile_commands.json, as CMake writes it.
input == 1 && match($0, /^  "command": "/) {
  flags = substr($0, RLENGTH + 1)
  sub(/ -o .*/, "", flags)
  sub(/^[^-]* -/, "-", flags)
  gsub(/-isystem /, "-isystem", flags)
  gsub(/-Winvalid-pch|-fpch-preprocess|-include [^ ]*/, "", flags)  # a header that gcc precompiled is not for clang
  gsub(/\\\\/, "\001", flags)
  gsub(/\\/, "", flags)
  gsub(/\001/, "\\", flags)
}
# The library for games is compiled again, with a stand-in for Abseil; only the stand-in's own test is checked so.
input == 1 && match($0, /^  "file": "/) {
  file = substr($0, RLENGTH + 1, length($0) - RLENGTH - 1)
  if (flags !~ /plain_abseil/ || file ~ /plain_abseil/) flags_of[file] = flags
}

input == 2 {
  read_names($0)
  alone = $0 ~ /plain_abseil/
  place($0)
}

END { for (batch = 1; batch <= batches; batch++) print flags_in[batch] list[batch] }

# The language standard that a source is compiled with.
function standard(source,    flags) {
  flags = flags_of[root source]
  return match(flags, /-std=[^ ]*/) ? substr(flags, RSTART, RLENGTH) : ""
}

function place(source,    batch, n, i, flags) {
  for (batch = 1; batch <= batches; batch++) {
    if (!alone && !closed[batch] && size[batch] < 32 && standard_of[batch] == standard(source) && fits(batch)) break
  }
  if (batch > batches) {
    batches = batch
    closed[batch] = alone
    standard_of[batch] = standard(source)
  }
  size[batch]++
  list[batch] = list[batch] "\t" source
  join(batch)
  n = split(flags_of[root source], flags, " ")
  for (i = 1; i <= n; i++) {
    if ((batch, flags[i]) in flagged) continue
    flagged[batch, flags[i]]
    flags_in[batch] = flags_in[batch] flags[i] " "
  }
}

# Whether the source that was read last can join a batch.
function fits(batch,    name, n, i, parts) {
  for (name in names) if ((batch, name) in declared_in) return 0
  for (name in unused) if ((batch, name) in mentioned_in) return 0
  if ("main" in declared && (batch, "main") in declared_in) return 0
  n = split(names_in[batch], parts, " ")
  for (i = 1; i <= n; i++) if (parts[i] in declared) return 0
  n = split(unused_in[batch], parts, " ")
  for (i = 1; i <= n; i++) if (parts[i] in words) return 0
  return 1
}

function join(batch,    name) {
  for (name in names) names_in[batch] = names_in[batch] " " name
  for (name in unused) unused_in[batch] = unused_in[batch] " " name
  for (name in declared) declared_in[batch, name]
  for (name in words) mentioned_in[batch, name]
}
