#!/usr/bin/env bash
# ./dev fresh: runs a command of ./dev in an empty Debian 12, to show that ./dev installs all that it needs.
#
#   fresh.sh COMMAND [ARGUMENT...]     as root, in the folder of the repository
#
# TESSERA_FRESH_BRING names a folder of the repository that git does not track and that the empty system is to have too.
#
# The empty system is made once, by debootstrap, and kept in build/fresh/base; each run works on a fresh overlay of it, which is
# deleted afterwards. It takes the sources and the proxies of this machine's apt, and whom this machine trusts, for npm behind a
# proxy that signs for itself. Mounts and processes of a run live in namespaces that end with it, however it ends. The network is
# that of this machine.
set -euo pipefail

readonly FRESH=$PWD/build/fresh
readonly BASE=$FRESH/base
readonly RELEASE=bookworm
readonly AUTHORITIES=/etc/ssl/authorities-of-the-host.crt  # in the empty system; no package's file

say() { printf 'dev: fresh: %s\n' "$*" >&2; }
fail() {
  say "$*"
  exit 1
}

# Lines "URI SUITE COMPONENT" of this machine's sources of Debian 12.
debian_sources() {
  # shellcheck disable=SC2016  # for apt to expand
  apt-get indextargets --format '$(REPO_URI) $(RELEASE) $(COMPONENT) $(ORIGIN) $(CODENAME)' 'Created-By: Packages' |
    awk -v release="$RELEASE" '$4 == "Debian" && index($5, release) == 1 { print $1, $2, $3 }' | sort -u
}

make_base() {
  [[ -e $BASE/etc/debian_version ]] && return
  local sources mirror proxy=
  sources=$(debian_sources)
  if [[ -z $sources ]]; then
    apt-get -q update >/dev/null
    sources=$(debian_sources)
  fi
  mirror=$(awk -v release="$RELEASE" '$2 == release && $3 == "main" { print $1; exit }' <<<"$sources")
  [[ -n $mirror ]] || fail "apt of this machine has no source of Debian $RELEASE main"
  eval "$(apt-config shell proxy Acquire::http::Proxy)"
  say "making an empty Debian $RELEASE from $mirror"
  rm -rf "$BASE.part"
  mkdir -p "$FRESH"
  local include=()
  if [[ $sources == *https:* ]]; then include=(--include=ca-certificates); fi
  http_proxy=${proxy:-${http_proxy:-}} debootstrap --variant=minbase "${include[@]}" "$RELEASE" "$BASE.part" "$mirror" \
    >"$FRESH/debootstrap.log" 2>&1 || {
    tail -n 15 "$FRESH/debootstrap.log" >&2
    fail "debootstrap failed (all of its output: $FRESH/debootstrap.log)"
  }
  while read -r uri suite component; do echo "deb $uri $suite $component"; done <<<"$sources" >"$BASE.part/etc/apt/sources.list"
  rm -f "$BASE.part"/var/cache/apt/archives/*.deb
  mv "$BASE.part" "$BASE"
}

# Copies the part that may change between runs: how this machine's apt and resolver reach the network.
copy_network() {
  local root=$1
  apt-config dump | grep -E '^Acquire::(http|https|ftp|Check-|Retries|By-Hash|Languages)' >"$root/etc/apt/apt.conf.d/00host" || true
  cp -L /etc/resolv.conf /etc/hosts "$root/etc/"
  if [[ -d /etc/apt/auth.conf.d ]]; then cp -a /etc/apt/auth.conf.d "$root/etc/apt/"; fi
  local authorities=${NODE_EXTRA_CA_CERTS:-/etc/ssl/certs/ca-certificates.crt}
  if [[ -r $authorities ]]; then
    mkdir -p "$root${AUTHORITIES%/*}"
    cp -L "$authorities" "$root$AUTHORITIES"
  fi
}

# The committed files and, as they are now, those that git tracks.
copy_repository() {
  local folder=$1 tree
  mkdir -p "$folder"
  tree=$(git -c safe.directory="$PWD" -c user.name=fresh -c user.email=fresh@localhost stash create)
  git -c safe.directory="$PWD" archive "${tree:-HEAD}" | tar -x -C "$folder" --no-same-owner
  if [[ -n ${TESSERA_FRESH_BRING:-} ]]; then
    mkdir -p "$folder/$TESSERA_FRESH_BRING"
    cp -a "$TESSERA_FRESH_BRING/." "$folder/$TESSERA_FRESH_BRING/"
  fi
}

# Devices that everybody may use, whatever the modes of this machine's are: apt works as a user of its own. Where none may be
# made, as in a container, this machine's are lent.
make_devices() {
  local folder=$1 device major minor
  while read -r device major minor; do
    mknod -m 666 "$folder/$device" c "$major" "$minor" 2>/dev/null && continue
    : >"$folder/$device"
    mount --bind "/dev/$device" "$folder/$device"
  done <<'END'
null 1 3
zero 1 5
full 1 7
random 1 8
urandom 1 9
tty 5 0
END
}

# enter RUN COMMAND...: in namespaces of its own. Nothing mounted here is seen outside, and all of it goes with the namespace.
enter() {
  local run=$1 root=$1/root device
  shift
  mount -t overlay overlay -o "lowerdir=$BASE,upperdir=$run/upper,workdir=$run/work" "$root" ||
    fail "cannot mount an overlay on $run"
  copy_network "$root"
  local authorities=
  if [[ -e $root$AUTHORITIES ]]; then authorities=$AUTHORITIES; fi
  # At its own path, so that what this machine has compiled of the same sources is found in its compiler cache; the cache is
  # the one thing that the empty system shares.
  copy_repository "$root$PWD"
  local cache=()
  if command -v ccache >/dev/null && [[ -d $(ccache --get-config cache_dir) ]]; then
    mkdir -p "$root/var/cache/ccache"
    mount --bind "$(ccache --get-config cache_dir)" "$root/var/cache/ccache"
    cache=(CCACHE_DIR=/var/cache/ccache CCACHE_MAXSIZE="$(ccache --get-config max_size)")
  fi
  mount -t proc proc "$root/proc"
  mount -t sysfs sysfs "$root/sys"
  mount -t tmpfs -o mode=755 tmpfs "$root/run"
  mount -t tmpfs -o mode=755 tmpfs "$root/dev"
  mkdir "$root/dev/pts" "$root/dev/shm"
  mount -t tmpfs -o mode=1777 tmpfs "$root/dev/shm"
  mount -t devpts -o newinstance,ptmxmode=0666,mode=620 devpts "$root/dev/pts"
  ln -s pts/ptmx "$root/dev/ptmx"
  ln -s /proc/self/fd "$root/dev/fd"
  make_devices "$root/dev"
  # This shell is process 1 of the namespace and waits for orphans too.
  # shellcheck disable=SC2016  # expands inside
  chroot "$root" /usr/bin/env -i HOME=/root TERM="${TERM:-dumb}" PATH=/usr/sbin:/usr/bin:/sbin:/bin ${CI:+CI="$CI"} \
    ${authorities:+NODE_EXTRA_CA_CERTS="$authorities"} \
    "${cache[@]}" ${TESSERA_MERGE:+TESSERA_MERGE="$TESSERA_MERGE"} ${TESSERA_SLOWNESS:+TESSERA_SLOWNESS="$TESSERA_SLOWNESS"} \
    bash -c 'cd "$0" && exec ./dev "$@"' "$PWD" "$@"
}

# Ends what still runs and deletes the run's folder; processes that were just killed may still add a file to it.
clean_up() {
  local run=$1
  if [[ -n $child ]]; then kill -KILL "$child" 2>/dev/null || true; fi
  wait 2>/dev/null
  rm -rf --one-file-system "$run" 2>/dev/null || { sleep 1 && rm -rf --one-file-system "$run"; }
}

main() {
  if [[ ${1:-} == --inside ]]; then
    shift
    enter "$@"
    return
  fi
  make_base
  local run status=0
  run=$(mktemp -d "$FRESH/run.XXXXXX")
  mkdir "$run/upper" "$run/work" "$run/root"
  child=
  # shellcheck disable=SC2064  # the run of now
  trap "clean_up '$run'" EXIT
  trap 'exit 130' INT
  trap 'exit 143' TERM HUP
  say "running ./dev $*"
  unshare --mount --pid --fork --kill-child=KILL bash "${BASH_SOURCE[0]}" --inside "$run" "$@" <&0 &
  child=$!
  wait "$child" || status=$?
  child=
  return "$status"
}

main "$@"
