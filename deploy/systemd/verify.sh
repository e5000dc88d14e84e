#!/usr/bin/env bash
# verify.sh BIN: checks the units of this folder by systemd's own tools, with the programs in folder BIN. systemd must
# understand every line, and the exposure of each must stay low (0 is none, 10 is all; a bare unit has 9.6).
set -euo pipefail

units=$(dirname -- "${BASH_SOURCE[0]}")
readonly BIN=$1
readonly MOST_EXPOSURE=25  # tenths

folder=$(mktemp -d)
trap 'rm -r -- "$folder"' EXIT
failed=0
for name in tessera-control tessera-agent tessera-gateway; do
  sed "s|=/usr/bin/|=$BIN/|" "$units/$name.service" >"$folder/$name.service"
  # It exits 0 on a line that it ignores, so silence is what counts.
  said=$(SYSTEMD_LOG_LEVEL=warning systemd-analyze verify --man=no "$folder/$name.service" 2>&1) || failed=1
  said=$(grep -F "$name" <<<"$said" || true)
  if [[ -n $said ]]; then
    printf '%s\n' "$said"
    failed=1
  fi
  systemd-analyze security --offline=true --no-pager --threshold="$MOST_EXPOSURE" "$folder/$name.service" |
    tail -n 1 || failed=1
done
exit "$failed"
