#!/usr/bin/env bash
# Runs the plug-in in Godot itself, from an installed package, without a window: the sample project with check.gd.
#
#   engine_test.sh CMAKE GENERATOR BUILD_DIR FAKE_INSTANCE GODOT
set -euo pipefail
cmake=$1 generator=$2 build=$3 fake_instance=$4 godot=$5

work=$(mktemp -d)
instance=
trap '[[ -z $instance ]] || kill "$instance" 2>/dev/null || true; rm -rf "$work"' EXIT

fail() { echo "engine_test: $*" >&2; exit 1; }

"$cmake" --install "$build" --prefix "$work/prefix" --component sdk >"$work/install.log" || { cat "$work/install.log"; fail "install"; }
share=$work/prefix/share/tessera
for part in godot examples; do
  { "$cmake" -G "$generator" -S "$share/$part" -B "$work/$part" -DCMAKE_PREFIX_PATH="$work/prefix" && "$cmake" --build "$work/$part"; } \
    >"$work/build.log" 2>&1 || { cat "$work/build.log"; fail "build of $part"; }
done
cp -r "$share/godot/sample" "$work/project"
cp "$(dirname -- "$0")/check.gd" "$work/project"
"$(dirname -- "$0")/../../package/make_folder.sh" "$(find "$work/prefix" -name libtessera-client.so)" \
  "$(dirname -- "$0")/../../../LICENSE" "$work/project/bin" >"$work/install.log"
"$cmake" --install "$work/godot" --prefix "$work/project" >"$work/install.log"

mkfifo "$work/address"
"$fake_instance" >"$work/address" &
instance=$!
read -r address <"$work/address"
"$work/examples/grant" "$address" plaza-1 "$work/project/grant" || fail "grant: exit $?"

# The first start finds the plug-in and writes down that it is there.
"$godot" --headless --path "$work/project" --editor --quit-after 300 >"$work/editor.log" 2>&1 || { cat "$work/editor.log"; fail "editor"; }
"$godot" --headless --path "$work/project" --script res://check.gd -- "$work/project/grant" >"$work/check.log" 2>&1 ||
  { cat "$work/check.log"; fail "check.gd"; }
grep -q '^check: passed' "$work/check.log" || { cat "$work/check.log"; fail "check.gd did not end"; }
# A command is refused on purpose, once for each way of drawing, which the log says.
[[ $(grep -c '^ERROR: bytes: 2000' "$work/check.log") == 2 && $(grep -c '^ERROR' "$work/check.log") == 2 ]] || { cat "$work/check.log"; fail "errors of the engine"; }
! grep -i 'leaked' "$work/check.log" || fail "objects that are left over"
echo "engine_test: $("$godot" --version) ran the plug-in"
