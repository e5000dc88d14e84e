#!/usr/bin/env bash
# Makes the folder that a game on Windows ships and is built with: the client library with its import library, the
# headers, both examples built against that folder alone, and the licences of all that is inside.
#
#   make_folder.sh BUILD PREFIX FOLDER       BUILD has the library; PREFIX is that of dependencies.sh
set -euo pipefail
build=$1 prefix=$2 folder=$3
readonly TOOLS=x86_64-w64-mingw32
library=$build/client_sdk/tessera-client.dll

fail() { echo "make_folder: $*" >&2; exit 1; }

rm -rf "${folder:?}"
mkdir -p "$folder"/{include/tessera,lib,examples,licences}
"$TOOLS-strip" --strip-unneeded -o "$folder/tessera-client.dll" "$library"
cp "$build/client_sdk/libtessera-client.dll.a" "$folder/lib/"
cp client_sdk/include/tessera/tessera.{h,hpp} game_sdk/include/tessera/movement.h "$folder/include/tessera/"
cp client_sdk/examples/watcher.c client_sdk/examples/drifter.cpp "$folder/examples/"
cp LICENSE "$folder/licences/tessera"
cp "$prefix"/licences/* "$folder/licences/"
# The compiler's libraries and Windows' C library are inside too.
for package in gcc-mingw-w64-base mingw-w64-common; do
  cp "/usr/share/doc/$package/copyright" "$folder/licences/$package"
done

# Nothing can be seen but the C interface, and all of it.
"$TOOLS-objdump" -p "$folder/tessera-client.dll" | awk '/^\[Ordinal\/Name Pointer\] Table/ { inside = 1; next }
  NF == 0 { inside = 0 } inside { print $NF }' | sort >"$folder/exported"
sed -n 's/^TESSERA_API .*[ *]\(tessera_[a-z0-9_]*\)(.*/\1/p' client_sdk/include/tessera/tessera.h |
  sort >"$folder/declared"
[[ -s $folder/declared ]] || fail "tessera.h declares nothing"
diff "$folder/declared" "$folder/exported" >&2 || fail "the library exports something else than tessera.h declares"
# From it other compilers make an import library of their own.
{ printf 'LIBRARY tessera-client.dll\nEXPORTS\n' && sed 's/^/  /' "$folder/exported"; } >"$folder/lib/tessera-client.def"
rm "$folder/declared" "$folder/exported"

# Every Windows since 10 has these.
allowed=' ADVAPI32.dll KERNEL32.dll msvcrt.dll WINMM.dll WS2_32.dll '
check_needs() {
  local needed
  for needed in $("$TOOLS-objdump" -p "$1" | sed -n 's/.*DLL Name: //p'); do
    [[ "$allowed tessera-client.dll " == *" $needed "* ]] || fail "$1 needs $needed"
  done
}
check_needs "$folder/tessera-client.dll"

readonly WARNINGS=(-Wall -Wextra -Wpedantic -Werror)
link=("-I$folder/include" "$folder/lib/libtessera-client.dll.a" -static -s '-Wl,--no-insert-timestamp')
"$TOOLS-gcc-posix" -std=c99 -O2 "${WARNINGS[@]}" -D__USE_MINGW_ANSI_STDIO=1 "$folder/examples/watcher.c" \
  -o "$folder/watcher.exe" "${link[@]}"
"$TOOLS-g++-posix" -std=c++17 -O2 "${WARNINGS[@]}" "$folder/examples/drifter.cpp" -o "$folder/drifter.exe" "${link[@]}"
for program in watcher drifter; do check_needs "$folder/$program.exe"; done
du -b "$folder/tessera-client.dll" | awk '{ printf "make_folder: %.1f MB, all of it in one file\n", $1 / 1e6 }'
