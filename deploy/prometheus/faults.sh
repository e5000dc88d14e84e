#!/usr/bin/env bash
# faults.sh OPERATING RULES RUNBOOK METRICS SOURCES...: all that the table of faults in OPERATING names is there: texts of
# events and of the log in SOURCES, metrics in SOURCES and METRICS, alerts in RULES and, as sections, in RUNBOOK. And each
# error that the folders control_plane and agent of SOURCES log is in that table, or in errors_without_a_row.
set -euo pipefail

[[ $# -ge 5 ]] || { sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 2; }
operating=$1 rules=$2 runbook=$3 metrics=$4
shift 4
# Texts of tests say nothing about what the programs write.
in_sources() { grep -rqF --include='*.cpp' --include='*.h' --exclude='*_test.cpp' --exclude-dir=testing -- "$1" "${sources[@]}"; }
sources=("$@")
result=0 rows=0 covered=''
missing() { echo "$1: $2 \"$3\" is not in $4"; result=1; }
# shellcheck disable=SC2016  # they are marks, and no command
text_of() { sed -n 's/^[^`]*`\(.*\)`[^`]*$/\1/p' <<<"$1"; }
while IFS='|' read -r _ fault event log metric alert _; do
  rows=$((rows + 1))
  fault=$(sed 's/^ *//; s/ *$//' <<<"$fault")
  for cell in "event:$event" "log:$log"; do
    text=$(text_of "${cell#*:}")
    if [[ -n $text ]] && ! in_sources "$text"; then missing "$fault" "${cell%%:*}" "$text" sources; fi
  done
  if [[ $log == *\`* && ! $log =~ ^\ (error|warning): ]]; then missing "$fault" level "$log" "the column of the log"; fi
  if [[ $log == \ error:* ]]; then covered+="$(text_of "$log")"$'\n'; fi
  name=$(text_of "$metric")
  if [[ -n $name ]]; then
    in_sources "\"$name\"" || missing "$fault" metric "$name" sources
    grep -qF "$name" "$metrics" || missing "$fault" metric "$name" "$metrics"
  fi
  alert=${alert// /}
  if [[ $alert != - ]]; then
    grep -q "^ *- alert: $alert\$" "$rules" || missing "$fault" alert "$alert" "$rules"
    grep -q "^## $alert\$" "$runbook" || missing "$fault" section "$alert" "$runbook"
    # The alert looks at the metric beside it.
    [[ -z $name ]] || grep -A 12 "^ *- alert: $alert\$" "$rules" | grep -q "$name" || missing "$fault" metric "$name" "$alert"
  fi
done < <(sed -n '/^### Faults that need somebody/,/^##* [^F]/p' "$operating" | grep '^|' | tail -n +3)
[[ $rows -gt 0 ]] || { echo "$operating has no table of faults"; exit 1; }

# The other way: the first string after spdlog::error( and level::err, and in the Log( that ends with Severity::kError.
errors_of() {
  awk '
    function first(text, at) {  # its first string, as in the source
      at = index(text, "\""); if (at == 0) return ""
      text = substr(text, at + 1)
      return match(text, /^([^"\\]|\\.)*/) ? substr(text, 1, RLENGTH) : ""
    }
    function say(file, found) { if (found != "") print file "\t" found }
    function each(file, all, rest, at, before, log_at) {
      for (rest = all; match(rest, /spdlog::error\(|level::err[,;]/); ) { rest = substr(rest, RSTART + RLENGTH); say(file, first(rest)) }
      for (rest = all; (at = index(rest, "Severity::kError")) > 0; rest = substr(rest, at + 16)) {
        before = substr(rest, 1, at - 1)
        if (before ~ /== *$/) continue
        while ((log_at = index(before, "Log(")) > 0) before = substr(before, log_at + 4)
        say(file, first(before))
      }
    }
    FNR == 1 && NR > 1 { each(name, all); all = "" }
    { name = FILENAME; sub(/^ *\/\/.*/, ""); all = all $0 " " }
    END { each(name, all) }' "$@"
}
without=$(grep -v '^#' "$(dirname "$0")/errors_without_a_row")
programs=()
for source in "${sources[@]}"; do
  case "$source" in */control_plane | control_plane | */agent | agent) programs+=("$source") ;; esac
done
mapfile -t files < <(find "${programs[@]}" -name '*.cpp' ! -name '*_test.cpp' ! -path '*/testing/*' | sort)
errors=0 found=''
while IFS=$'\t' read -r file error; do
  errors=$((errors + 1)) found+="$error"$'\n' listed=''
  while IFS= read -r text; do
    if [[ -n $text && $error == *"$text"* ]]; then listed=1; fi
  done < <(printf '%s' "$covered"; sed 's/ -- .*//; /^{}$/d' <<<"$without")
  if [[ $error == '{}' ]] && grep -q '^{} -- ' <<<"$without"; then listed=1; fi
  if [[ -z $listed ]]; then echo "$file: error \"$error\" is neither in the table of $operating nor in errors_without_a_row"; result=1; fi
done < <(errors_of "${files[@]}")
[[ $errors -ge 20 ]] || { echo "found $errors errors in ${sources[*]}: the sources are not read as they are written"; exit 1; }
while IFS= read -r line; do
  if [[ $line != *' -- '?* ]]; then echo "errors_without_a_row: \"$line\" has no reason"; result=1; fi
  if ! grep -qF -- "${line%% -- *}" <<<"$found"; then echo "errors_without_a_row: no error has \"${line%% -- *}\""; result=1; fi
done <<<"$without"
exit "$result"
