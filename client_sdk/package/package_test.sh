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
library=$(echo "$work"/prefix/lib*/*/libtessera-client.so "$work"/prefix/lib*/libtessera-client.so | tr ' ' '\n' | grep -v '[*]' | head -n 1)
# Nothing can be seen of each but the C interface, and what it needs is looked for beside it.
for name in client connect local; do
  each=${library/tessera-client/tessera-$name}
  foreign=$(nm -D --defined-only "$each" | awk '$2 != "A" && $3 !~ /^tessera_/ { print $3 }')
  [[ -z $foreign ]] || fail "symbols of $each that should be hidden: $foreign"
  nm -D --defined-only "$each" | grep ' T tessera_' >/dev/null || fail "$each has no interface"
  readelf -d "$each" | grep -F "Library runpath: [\$ORIGIN]" >/dev/null || fail "$each does not look beside itself"
done

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

# Builds without CMake find each library by pkg-config, wherever the folder stands, and link it alone.
mv "$work/prefix" "$work/moved"
found() { PKG_CONFIG_PATH=$(dirname "${library/"$work/prefix"/"$work/moved"}")/pkgconfig pkg-config "$@"; }
mkdir "$work/by_hand"
for built in watcher.c=tessera-client drifter.cpp=tessera-client grant.c=tessera-connect; do
  source=${built%=*} package=${built#*=}
  [[ $(found --modversion "$package") == "$(found --modversion tessera-client)" ]] || fail "pkg-config knows no $package"
  read -ra flags <<<"$(found --cflags --libs "$package")"
  if [[ $source == *.c ]]; then compile=(cc -std=c99); else compile=(c++ -std=c++17); fi
  "${compile[@]}" "${examples/"$work/prefix"/"$work/moved"}/$source" -o "$work/by_hand/${source%.*}" "${flags[@]}" || fail "pkg-config: $source"
  readelf -d "$work/by_hand/${source%.*}" | grep "NEEDED.*lib$package" >/dev/null || fail "$source is not linked with $package"
done
found --exists tessera-local || fail "pkg-config knows no tessera-local"
mv "$work/moved" "$work/prefix"

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
