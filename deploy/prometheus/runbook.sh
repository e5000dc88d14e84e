#!/usr/bin/env bash
# runbook.sh RULES RUNBOOK: every alert of RULES has a section in RUNBOOK, and every section is of an alert.
set -euo pipefail

[[ $# -eq 2 ]] || { sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 2; }
alerts=$(sed -n 's/^ *- alert: *//p' "$1" | sort)
sections=$(sed -n 's/^## //p' "$2" | sort)
[[ -n $alerts ]] || { echo "$1 has no alert"; exit 1; }
# Lines of one alone: alerts at the left, sections further right.
apart=$(comm -3 <(printf '%s\n' "$alerts") <(printf '%s\n' "$sections"))
[[ -z $apart ]] || { printf 'without a section, or a section without an alert:\n%s\n' "$apart"; exit 1; }
