#!/usr/bin/env bash
# Makes the folder that a game on Windows ships and is built with: the client library with its import library, the
# headers, the examples built against that folder alone, and the licences of all that is inside. For development there
# is the way through a control plane beside it, a library of its own with libcurl inside.
#
#   make_folder.sh BUILD PREFIX FOLDER       BUILD has the library; PREFIX is that of dependencies.sh
set -euo pipefail
build=$1 prefix=$2 folder=$3
readonly TOOLS=x86_64-w64-mingw32

fail() { echo "make_folder: $*" >&2; exit 1; }

rm -rf "${folder:?}"
mkdir -p "$folder"/{include/tessera,lib,examples,licences}
cp client_sdk/include/tessera/{tessera,connect}.{h,hpp} game_sdk/include/tessera/movement.h "$folder/include/tessera/"
cp client_sdk/examples/{watcher,grant}.c client_sdk/examples/drifter.cpp "$folder/examples/"
cp LICENSE "$folder/licences/tessera"
cp "$prefix"/licences/* "$folder/licences/"
# The compiler's libraries and Windows' C library are inside too.
for package in gcc-mingw-w64-base mingw-w64-common; do
  cp "/usr/share/doc/$package/copyright" "$folder/licences/$package"
done

# add_library NAME HEADER: nothing can be seen of it but what the header declares, and all of that.
add_library() {
  local name=$1 header=client_sdk/include/tessera/$2
  "$TOOLS-strip" --strip-unneeded -o "$folder/$name.dll" "$build/client_sdk/$name.dll"
  cp "$build/client_sdk/lib$name.dll.a" "$folder/lib/"
  "$TOOLS-objdump" -p "$folder/$name.dll" | awk '/^\[Ordinal\/Name Pointer\] Table/ { inside = 1; next }
    NF == 0 { inside = 0 } inside { print $NF }' | sort >"$folder/exported"
  sed -n 's/^TESSERA_API .*[ *]\(tessera_[a-z0-9_]*\)(.*/\1/p' "$header" | sort >"$folder/declared"
  [[ -s $folder/declared ]] || fail "$header declares nothing"
  diff "$folder/declared" "$folder/exported" >&2 || fail "$name.dll exports something else than $header declares"
  # From it other compilers make an import library of their own.
  { printf 'LIBRARY %s.dll\nEXPORTS\n' "$name" && sed 's/^/  /' "$folder/exported"; } >"$folder/lib/$name.def"
  rm "$folder/declared" "$folder/exported"
}
add_library tessera-client tessera.h
add_library tessera-connect connect.h

# Every Windows since 10 has these.
readonly ALLOWED=' ADVAPI32.dll KERNEL32.dll msvcrt.dll WINMM.dll WS2_32.dll '
# check_needs FILE [MORE]
check_needs() {
  local needed
  for needed in $("$TOOLS-objdump" -p "$1" | sed -n 's/.*DLL Name: //p'); do
    [[ "$ALLOWED${2:-}" == *" $needed "* ]] || fail "$1 needs $needed"
  done
}
check_needs "$folder/tessera-client.dll"
check_needs "$folder/tessera-connect.dll" " tessera-client.dll CRYPT32.dll bcrypt.dll "

readonly WARNINGS=(-Wall -Wextra -Wpedantic -Werror)
link=("-I$folder/include" "$folder/lib/libtessera-client.dll.a" -static -s '-Wl,--no-insert-timestamp')
"$TOOLS-gcc-posix" -std=c99 -O2 "${WARNINGS[@]}" -D__USE_MINGW_ANSI_STDIO=1 "$folder/examples/watcher.c" \
  -o "$folder/watcher.exe" "${link[@]}"
"$TOOLS-g++-posix" -std=c++17 -O2 "${WARNINGS[@]}" "$folder/examples/drifter.cpp" -o "$folder/drifter.exe" "${link[@]}"
"$TOOLS-gcc-posix" -std=c99 -O2 "${WARNINGS[@]}" "$folder/examples/grant.c" -o "$folder/grant.exe" \
  "$folder/lib/libtessera-connect.dll.a" "${link[@]}"
for program in watcher drifter grant; do
  check_needs "$folder/$program.exe" " tessera-client.dll tessera-connect.dll "
done
du -b "$folder/tessera-client.dll" | awk '{ printf "make_folder: a game ships %.1f MB, in one file\n", $1 / 1e6 }'
