#!/usr/bin/env bash
# alerts_tested.sh RULES TESTS: every alert of RULES is seen to fire in TESTS, and to be silent.
set -euo pipefail

[[ $# -eq 2 ]] || { sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 2; }
alerts=$(sed -n 's/^ *- alert: *//p' "$1")
[[ -n $alerts ]] || { echo "$1 has no alert"; exit 1; }
result=0
while read -r alert; do
  if ! grep -q "alertname: $alert, exp_alerts: \[\]" "$2"; then echo "$alert is never seen silent"; result=1; fi
  if ! grep -A 2 "^ *alertname: $alert\$" "$2" | grep -q 'exp_labels'; then echo "$alert is never seen firing"; result=1; fi
done <<<"$alerts"
exit "$result"
