#!/usr/bin/env bash
# Installs the client library into an empty prefix, builds the installed examples against that alone, and runs both in an
# instance.
#
#   package_test.sh CMAKE GENERATOR BUILD_DIR FAKE_INSTANCE
set -euo pipefail
cmake=$1 generator=$2 build=$3 fake_instance=$4

work=$(mktemp -d)
instance=
trap '[[ -z $instance ]] || kill "$instance" 2>/dev/null || true; rm -rf "$work"' EXIT

fail() { echo "package_test: $*" >&2; exit 1; }

"$cmake" --install "$build" --prefix "$work/prefix" --component sdk >"$work/install.log" || { cat "$work/install.log"; fail "install"; }
# Public headers and nothing else; no type of the libraries inside.
headers=$(cd "$work/prefix" && find ./include -name '*.h' -o -name '*.hpp' | sort | tr '\n' ' ')
[[ $headers == "./include/tessera/connect.h ./include/tessera/connect.hpp ./include/tessera/local.h ./include/tessera/local.hpp ./include/tessera/movement.h ./include/tessera/tessera.h ./include/tessera/tessera.hpp " ]] || fail "installed headers: $headers"
! grep -nE '\bbt[A-Z]|protobuf|ENet|absl|grpc' "$work"/prefix/include/tessera/* || fail "a header names what is inside"
# Nothing can be seen but the C interface.
library=$(echo "$work"/prefix/lib*/*/libtessera-client.so "$work"/prefix/lib*/libtessera-client.so | tr ' ' '\n' | grep -v '[*]' | head -n 1)
foreign=$(nm -D --defined-only "$library" | awk '$2 != "A" && $3 !~ /^tessera_/ { print $3 }')
[[ -z $foreign ]] || fail "symbols that should be hidden: $foreign"

# The library may need the system's libraries that every program has, and those that stand beside it (docs/sdk.md).
allowed=' libc.so.6 libm.so.6 libstdc++.so.6 libgcc_s.so.1 ld-linux-x86-64.so.2 libenet.so.7 libBulletCollision.so.3.24 libLinearMath.so.3.24 '
for needed in $(readelf -d "$library" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p'); do
  [[ $allowed == *" $needed "* ]] || fail "$library needs $needed"
done

# The way through a control plane needs libcurl and what that brings: no library of gRPC, protobuf or Abseil, however deep.
connect=${library/tessera-client/tessera-connect}
for needed in $(readelf -d "$connect" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p'); do
  [[ "$allowed libcurl.so.4 libtessera-client.so.0 " == *" $needed "* ]] || fail "$connect needs $needed"
done
brought=$(ldd "$connect" | awk '{ print $1 }' | grep -E 'grpc|protobuf|absl' || true)
[[ -z $brought ]] || fail "$connect brings $brought"
foreign=$(nm -D --defined-only "$connect" | awk '$2 != "A" && $3 !~ /^tessera_/ { print $3 }')
[[ -z $foreign ]] || fail "symbols of $connect that should be hidden: $foreign"

# A backend finds the messages that it speaks, each with what it imports.
protos=$work/prefix/share/tessera/proto examples=$work/prefix/share/tessera/examples
for service in access instance session; do
  [[ -f $protos/tessera/v1/$service.proto ]] || fail "$service.proto is not installed"
done
grep -rhoE '^import "tessera/[^"]+' "$protos" | sed 's/^import "//' | sort -u | while read -r imported; do
  [[ -f $protos/$imported ]] || fail "$imported is imported and not installed"
done

# Whoever writes in C# finds the sources of the binding, and what wrote them.
for source in Native.cs Values.cs World.cs Connect.cs sample/Drifter.cs make_csharp.py; do
  [[ -f $work/prefix/share/tessera/csharp/$source ]] || fail "csharp/$source is not installed"
done
python3 "$work/prefix/share/tessera/csharp/make_csharp.py" "$work"/prefix/include/tessera/{tessera,connect,local}.h |
  cmp - "$work/prefix/share/tessera/csharp/Native.cs" || fail "make_csharp.py of the package writes another Native.cs"

# The generator of this build: CMake's own choice may be a program that is not installed.
"$cmake" -G "$generator" -S "$examples" -B "$work/examples" -DCMAKE_PREFIX_PATH="$work/prefix" >"$work/configure.log" 2>&1 || { cat "$work/configure.log"; fail "configure"; }
"$cmake" --build "$work/examples" >"$work/build.log" 2>&1 || { cat "$work/build.log"; fail "build"; }

# The plug-in for Godot: what can be seen of it is the function by which the engine begins, and it is loaded.
"$cmake" -G "$generator" -S "$work/prefix/share/tessera/godot" -B "$work/godot" -DCMAKE_PREFIX_PATH="$work/prefix" >"$work/configure.log" 2>&1 || { cat "$work/configure.log"; fail "configure the plug-in"; }
"$cmake" --build "$work/godot" >"$work/build.log" 2>&1 || { cat "$work/build.log"; fail "build the plug-in"; }
"$cmake" --install "$work/godot" --prefix "$work/sample" >"$work/install.log" || { cat "$work/install.log"; fail "install the plug-in"; }
seen=$(nm -D --defined-only "$work/sample/bin/libtessera-godot.so" | awk '$2 == "T" { print $3 }')
[[ $seen == tessera_godot_init ]] || fail "symbols of the plug-in: $seen"
python3 -c 'import ctypes, sys; ctypes.CDLL(sys.argv[1]).tessera_godot_init' "$work/sample/bin/libtessera-godot.so" || fail "the plug-in cannot be loaded"
grep -q 'res://bin/libtessera-godot.so' "$work/prefix/share/tessera/godot/sample/tessera.gdextension" || fail "the sample names another plug-in"

mkfifo "$work/address"
"$fake_instance" >"$work/address" &
instance=$!
read -r address <"$work/address"
for example in watcher drifter; do
  "$work/examples/grant" "$address" plaza-1 "$work/$example.grant" || fail "grant: exit $?"
  "$work/examples/$example" "$work/$example.grant" 2 >"$work/$example.log" 2>&1 || { cat "$work/$example.log"; fail "$example: exit $?"; }
  grep -q 'player [0-9]* in plaza' "$work/$example.log" || { cat "$work/$example.log"; fail "$example did not join"; }
  grep -q '2 bodies' "$work/$example.log" || { cat "$work/$example.log"; fail "$example saw no bodies"; }
done
echo "package_test: the library needs nothing foreign; the plug-in and both examples built from the installed package and played by grants"
