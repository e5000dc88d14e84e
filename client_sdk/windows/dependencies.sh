#!/usr/bin/env bash
# Builds the libraries that the client library for Windows has inside, ENet, libsodium and Bullet's collision libraries,
# and libcurl for the one by which games join in development, statically and for Windows, from the sources of the Debian
# packages that the Linux build uses.
#
#   dependencies.sh FOLDER [NAME=SOURCES...]
#
# FOLDER/prefix gets include, lib and licences. apt fetches the sources, in the version that is installed here, and
# checks them by the archive's signatures. Where the mirror lacks one, NAME=SOURCES names a folder with its sources
# unpacked (enet, libsodium, bullet or curl). ENet's headers must be those that are installed here. A library that is built
# already, in that version, stays.
set -euo pipefail
export LC_ALL=C.UTF-8

readonly TOOLCHAIN=$PWD/client_sdk/windows/toolchain.cmake
readonly HOST=x86_64-w64-mingw32
readonly KEYS=/usr/share/keyrings/debian-archive-keyring.gpg

say() { printf 'dev: windows: %s\n' "$*" >&2; }
fail() {
  say "$*"
  exit 1
}

[[ $# -gt 0 ]] || fail "usage: dependencies.sh FOLDER [NAME=SOURCES...]"
mkdir -p "$1"
folder=$(realpath "$1")
shift
prefix=$folder/prefix
declare -A given=()
for argument in "$@"; do
  [[ $argument =~ ^(enet|libsodium|bullet|curl)=(.+)$ ]] || fail "$argument: enet, libsodium, bullet or curl, = and a folder"
  [[ -d ${BASH_REMATCH[2]} ]] || fail "${BASH_REMATCH[1]}: ${BASH_REMATCH[2]} is no folder"
  given[${BASH_REMATCH[1]}]=$(realpath "${BASH_REMATCH[2]}")
done
mkdir -p "$folder"/{apt/lists/partial,apt/archives/partial,sources,built} "$prefix"/{include,lib,licences}

# Runs a command; shows the end of what it printed where it fails.
logged() {
  local log=$folder/$1.log
  shift
  "$@" >"$log" 2>&1 </dev/null || {
    tail -n 20 "$log" >&2
    fail "failed: $* (all of its output: $log)"
  }
}

# source_apt LIST ARGUMENT...: apt with lists of its own, of sources: those of the machine stay as they are.
source_apt() {
  local list=$1
  shift
  apt-get -q -o Dir::Etc::SourceList="$folder/apt/$list.list" -o Dir::Etc::SourceParts=/dev/null \
    -o Dir::State::Lists="$folder/apt/lists" -o Dir::Cache="$folder/apt" -o APT::Sandbox::User=root "$@"
}

# The mirrors are the machine's.
update_lists() {
  [[ -e $folder/apt/updated ]] && return
  # shellcheck disable=SC2016  # for apt to expand
  apt-get indextargets --format '$(REPO_URI) $(RELEASE) $(COMPONENT) $(ORIGIN) $(CODENAME)' 'Created-By: Packages' |
    awk -v keys="$KEYS" '$4 == "Debian" && index($5, "bookworm") == 1 {
      print "deb-src [signed-by=" keys "] " $1, $2, $3 }' | sort -u >"$folder/apt/all.list"
  [[ -s $folder/apt/all.list ]] || fail "apt of this machine has no source of Debian bookworm; run apt-get update"
  grep -v -e -security "$folder/apt/all.list" >"$folder/apt/archive.list"
  logged apt-update source_apt all -o APT::Update::Error-Mode=any update
  touch "$folder/apt/updated"
}

# fetch NAME VERSION: from the archive, or from its security updates where only they have it.
fetch() {
  source_apt archive source --download-only "$1=$2" && return
  source_apt all source --download-only "$1=$2" && return
  echo "apt finds no sources of $1 $2; --sources $1=FOLDER takes them from a folder"
  return 1
}

# sources_of NAME VERSION: sets `sources` to the unpacked sources of that version, or to those that were given.
sources_of() {
  local name=$1 version=$2
  sources=${given[$name]:-$folder/sources/$name-$version}
  if [[ -d $sources ]]; then return; fi
  say "fetching the sources of $name $version"
  update_lists
  cd "$folder/sources"
  logged "fetch-$name" fetch "$name" "$version"
  cd - >/dev/null
  rm -rf "$sources.part"
  logged "unpack-$name" dpkg-source -x "$folder/sources/${name}_${version#*:}.dsc" "$sources.part"
  mv "$sources.part" "$sources"
}

# The adapter depends on ENet's inside, so it must be the version that the Linux build has.
build_enet() {
  local header source
  for header in "$sources"/include/enet/*.h; do
    cmp -s "$header" "/usr/include/enet/${header##*/}" || fail "enet: $header is not that of the installed libenet-dev"
  done
  mkdir -p "$folder/enet"
  rm -f "$folder"/enet/*.o "$folder/enet/libenet.a"
  for source in "$sources"/*.c; do
    "$HOST-gcc-posix" -O2 -DNDEBUG -ffunction-sections -fdata-sections -I "$sources/include" -c "$source" \
      -o "$folder/enet/$(basename "$source" .c).o" || fail "enet: cannot compile $source"
  done
  "$HOST-ar" rcs "$folder/enet/libenet.a" "$folder"/enet/*.o
  cp -r "$sources/include/enet" "$prefix/include/"
  cp "$folder/enet/libenet.a" "$prefix/lib/"
}

build_libsodium() {
  rm -rf "$folder/libsodium"
  cp -r "$sources" "$folder/libsodium"
  cd "$folder/libsodium"
  logged autoreconf-libsodium autoreconf -fi
  logged configure-libsodium ./configure --host="$HOST" --prefix="$prefix" --disable-shared --enable-static --with-pic \
    CC="$HOST-gcc-posix" CFLAGS="-O2 -ffunction-sections -fdata-sections"
  logged build-libsodium make -C src/libsodium -j "${TESSERA_JOBS:-1}" install
  cd - >/dev/null
}

build_bullet() {
  logged configure-bullet cmake -G Ninja -S "$sources" -B "$folder/bullet" --toolchain "$TOOLCHAIN" -Wno-dev \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS_RELEASE="-O2 -DNDEBUG -w -ffunction-sections -fdata-sections" \
    -DCMAKE_DISABLE_FIND_PACKAGE_OpenGL=ON -DBUILD_SHARED_LIBS=OFF -DUSE_DOUBLE_PRECISION=OFF \
    -DBUILD_EXTRAS=OFF -DBUILD_BULLET3=OFF -DBUILD_BULLET2_DEMOS=OFF -DBUILD_OPENGL3_DEMOS=OFF \
    -DBUILD_CPU_DEMOS=OFF -DBUILD_UNIT_TESTS=OFF -DBUILD_PYBULLET=OFF
  logged build-bullet cmake --build "$folder/bullet" -j "${TESSERA_JOBS:-1}" --target BulletCollision LinearMath
  mkdir -p "$prefix/include/bullet"
  (cd "$sources/src" && find BulletCollision LinearMath -name '*.h' -exec cp --parents {} "$prefix/include/bullet/" \;)
  find "$folder/bullet" -name 'lib*.a' -exec cp {} "$prefix/lib/" \;
}

# HTTP and HTTPS alone, by Windows' own TLS, which is told the cluster's authority. The JSON that goes over it is read
# by headers, which are the Linux build's.
build_curl() {
  logged configure-curl cmake -G Ninja -S "$sources" -B "$folder/curl" --toolchain "$TOOLCHAIN" -Wno-dev \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_FLAGS_RELEASE="-O2 -DNDEBUG -w -ffunction-sections -fdata-sections" \
    -DBUILD_SHARED_LIBS=OFF -DBUILD_CURL_EXE=OFF -DBUILD_TESTING=OFF -DENABLE_MANUAL=OFF -DHTTP_ONLY=ON \
    -DCURL_USE_SCHANNEL=ON -DCURL_ZLIB=OFF -DCURL_BROTLI=OFF -DCURL_ZSTD=OFF -DUSE_NGHTTP2=OFF -DUSE_LIBIDN2=OFF \
    -DCURL_USE_LIBPSL=OFF -DCURL_USE_LIBSSH2=OFF -DCURL_USE_LIBSSH=OFF
  logged build-curl cmake --build "$folder/curl" -j "${TESSERA_JOBS:-1}" --target libcurl
  cp -r "$sources/include/curl" "$prefix/include/"
  cp "$folder"/curl/lib/libcurl*.a "$prefix/lib/libcurl.a"
  cp -r /usr/include/nlohmann "$prefix/include/"
  cp /usr/share/doc/nlohmann-json3-dev/copyright "$prefix/licences/nlohmann-json"
}

readonly -A PACKAGES=([enet]=libenet-dev [libsodium]=libsodium-dev [bullet]=libbullet-dev [curl]=libcurl4-openssl-dev)
for library in enet libsodium bullet curl; do
  version=$(dpkg-query -W -f '${source:Version}' "${PACKAGES[$library]}")
  if [[ -r $folder/built/$library && $(<"$folder/built/$library") == "$version" ]]; then continue; fi
  sources_of "$library" "$version"
  say "building $library $version for Windows"
  "build_$library"
  cp "/usr/share/doc/${PACKAGES[$library]}/copyright" "$prefix/licences/$library"
  echo "$version" >"$folder/built/$library"
done
