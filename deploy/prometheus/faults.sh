#!/usr/bin/env bash
# faults.sh OPERATING RULES RUNBOOK METRICS SOURCES...: all that the table of faults in OPERATING names is there: texts of
# events and of the log in SOURCES, metrics in SOURCES and METRICS, alerts in RULES and, as sections, in RUNBOOK.
set -euo pipefail

[[ $# -ge 5 ]] || { sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 2; }
operating=$1 rules=$2 runbook=$3 metrics=$4
shift 4
# Texts of tests say nothing about what the programs write.
in_sources() { grep -rqF --include='*.cpp' --include='*.h' --exclude='*_test.cpp' --exclude-dir=testing -- "$1" "${sources[@]}"; }
sources=("$@")
result=0 rows=0
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
exit "$result"
