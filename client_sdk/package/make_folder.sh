#!/usr/bin/env bash
# Makes the folder that a game ships: the client library, stripped, the libraries that it needs beside those of every
# system, and the licences of all.
#
#   make_folder.sh LIBRARY LICENSE FOLDER
set -euo pipefail
library=$1 license=$2 folder=$3

fail() { echo "make_folder: $*" >&2; exit 1; }

mkdir -p "$folder/licences"
name=$(readelf -d "$library" | sed -n 's/.*(SONAME).*\[\(.*\)\]/\1/p')
strip --strip-unneeded -o "$folder/$name" "$library"
cp "$license" "$folder/licences/tessera"
cp /usr/share/doc/libsodium-dev/copyright "$folder/licences/libsodium"  # which is inside

# Copies the libraries that stand beside it, by its own needs; those of every system stay where they are.
copy_needed() {
  ldd "$1" | awk '$2 == "=>" { print $1, $3 }' | while read -r needed path; do
    case $needed in
      libc.so.* | libm.so.* | libstdc++.so.* | libgcc_s.so.* | libpthread.so.* | ld-linux*) continue ;;
    esac
    [[ -e $path ]] || fail "$1 needs $needed, which is not installed"
    strip --strip-unneeded -o "$folder/$needed" "$path"
    package=$(dpkg-query -S "$(readlink -f "$path")" | head -n 1 | cut -d : -f 1)
    cp "/usr/share/doc/$package/copyright" "$folder/licences/$package"
  done
}
copy_needed "$library"
du -cb "$folder"/*.so* | awk 'END { printf "make_folder: %.1f MB of libraries\n", $1 / 1e6 }'
