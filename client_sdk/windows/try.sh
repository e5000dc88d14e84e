#!/usr/bin/env bash
# Tries the client library for Windows, by Wine. Its unit tests run; then three programs join a world that runs on this
# machine, over the loopback, by grants. Both examples see it; `walker.exe` walks in it and is predicted, keeps the scene
# and records. At last `grant.exe` gets a grant from a players' door by TLS, and by no other authority's.
#
#   try.sh INSTANCES FOLDER TESTS      INSTANCES has tessera_local_instance and tessera_fake_instance; FOLDER is that of
#                                      make_folder.sh; TESTS has the unit tests
set -euo pipefail
instances=$1 folder=$2 tests=$3
readonly WINE=/usr/lib/wine/wine64
readonly WALK_S=8
readonly MOST_CORRECTIONS=16  # without loss and delay it has next to none; a busy machine polls late

work=$(mktemp -d)
instance=
clean_up() {
  if [[ -n $instance ]]; then kill "$instance" 2>/dev/null || true; fi
  /usr/lib/wine/wineserver64 -k 2>/dev/null || true
  rm -rf "$work"
}
trap clean_up EXIT

say() { printf 'dev: windows: %s\n' "$*" >&2; }
fail() {
  say "$*"
  exit 1
}

# expect PROGRAM REGEX WHY: the program has printed a line like that.
expect() {
  grep -qE "$2" "$work/$1.log" && return
  cat "$work/$1.log" >&2
  fail "$1.exe $3"
}

# play PROGRAM ARGUMENT...: by its grant.
play() {
  local program=$1
  shift
  say "$program.exe joins by a grant"
  "$WINE" "$work/bin/$program.exe" "$work/$program.grant" "$@" >"$work/$program.log" 2>&1 </dev/null || {
    cat "$work/$program.log" >&2
    fail "$program.exe failed"
  }
}

# run_tests FOLDER: each program in it; at least one test must have passed in each.
run_tests() {
  local program name passed all=0 count=0
  for program in "$1"/*.exe; do
    [[ -e $program ]] || fail "there are no tests in $1"
    name=$(basename "$program" .exe)
    "$WINE" "$program" --gtest_color=no >"$work/$name.log" 2>&1 </dev/null || {
      grep -E '^\[  FAILED|Failure|error' -A 6 "$work/$name.log" | tail -n 60 >&2
      fail "$name.exe failed"
    }
    passed=$(sed -n 's/^\[  PASSED  \] \([0-9]*\) tests\{0,1\}\..*/\1/p' "$work/$name.log")
    ((${passed:-0} > 0)) || fail "$name.exe ran no test"
    all=$((all + passed)) count=$((count + 1))
  done
  say "$all unit tests passed, in $count programs"
}

# Wine without a display, and without what it would ask to download.
export WINEPREFIX=$work/wine WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml=;winemenubuilder.exe=d"
unset DISPLAY

run_tests "$tests"

mkdir "$work/bin"
cp "$folder"/*.exe "$folder"/*.dll "$work/bin/"
x86_64-w64-mingw32-gcc-posix -std=c99 -O2 -Wall -Wextra -Werror -D__USE_MINGW_ANSI_STDIO=1 -I "$folder/include" \
  client_sdk/windows/walker.c "$folder/lib/libtessera-client.dll.a" -static -s -o "$work/bin/walker.exe"

mkfifo "$work/ready"
"$instances/tessera_local_instance" scenes/course.textproto "$work"/{watcher,drifter,walker}.grant >"$work/ready" &
instance=$!
read -r _ <"$work/ready" || fail "the world did not begin"
for example in watcher drifter; do
  play "$example" 3
  expect "$example" 'player [0-9]+ in course' "did not join"
  expect "$example" 'I am at \(' "did not see its body"
done

mkdir "$work/kept"
play walker "$work/kept" "$WALK_S"
expect walker 'walked [1-9][0-9.]* m in .*, predicting 1, .* 0 decode errors' "was not predicted"
expect walker 'the recording has [3-9] bodies' "did not play its recording"
corrections=$(sed -n 's/.*predicting 1, \([0-9]*\) corrections.*/\1/p' "$work/walker.log" | tail -n 1)
((corrections <= MOST_CORRECTIONS)) || fail "the prediction was corrected $corrections times in $WALK_S s"
[[ -s $work/kept/матч.tsr ]] || fail "the recording is not in the file that was named"
[[ -n $(find "$work/kept/мир" -name '*.tsrs') ]] || fail "the scene was not kept in the folder that was named"
tail -n 2 "$work/walker.log" >&2

kill "$instance"
wait "$instance" || true
"$instances/tessera_fake_instance" --tls >"$work/ready" &
instance=$!
read -r address <"$work/ready" || fail "the instance with a players' door did not begin"
dead=127.0.0.1:9#${address#*#}
say "grant.exe asks the players' door at ${address%%#*} by TLS"
"$WINE" "$work/bin/grant.exe" "$dead,$address" plaza-1 "$work/plaza.grant" >"$work/grant.log" 2>&1 || {
  cat "$work/grant.log" >&2
  fail "grant.exe failed"
}
mv "$work/plaza.grant" "$work/watcher.grant"
play watcher 3
expect watcher 'player [0-9]+ in plaza' "did not join by the grant"
other=${address%#*}#$(printf '0%.0s' {1..64})
if "$WINE" "$work/bin/grant.exe" "$other" plaza-1 "$work/other.grant" >"$work/grant.log" 2>&1; then
  fail "grant.exe takes a grant from a cluster whose authority was not named"
fi
expect grant 'what answers is not the cluster whose authority was named' "does not say why"
say "all played, by $("$WINE" --version)"
