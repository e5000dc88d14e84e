#!/usr/bin/env bash
# try.sh PACKAGES: installs, uses, upgrades, removes and purges the packages of folder PACKAGES, and checks each step.
#
# For an empty Debian 12 that is thrown away afterwards: `./dev package --try` runs it in one. Services are tried under
# systemd by deploy/systemd/try_units.sh, from the same packages; here is no systemd.
set -euo pipefail

[[ $# -eq 1 ]] || { sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 2; }
PACKAGES=$(realpath -- "$1")
readonly PACKAGES
readonly LONGEST_TO_A_WORLD_S=60  # from the packages to a world that runs

fail() {
  printf 'FAILED: %s\n' "$*" >&2
  exit 1
}
apt() { env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o Dpkg::Use-Pty=0 "$@" >/tmp/apt.log 2>&1 || { cat /tmp/apt.log >&2; fail "apt-get $*"; }; }
as_user() { setpriv --reuid=player --regid=player --clear-groups env -i HOME=/home/player PATH=/usr/bin:/bin "$@"; }
# Lines "path" of everything of ours that is installed.
ours() { find / -xdev \( -path /proc -o -path /sys -o -path "$PWD" -o -path /tmp \) -prune -o -iname '*tessera*' -print | sort; }

useradd --create-home player
apt update

# --- A first world ----------------------------------------------------------------------------------------------------

begin=$SECONDS
begin_us=${EPOCHREALTIME/./}
apt install --no-install-recommends "$PACKAGES"/tessera-*.deb
as_user tessera -o json demo --seconds 5 --page-listen 127.0.0.1:0 >/tmp/demo.json 2>/tmp/demo.log ||
  { cat /tmp/demo.log >&2; fail "tessera demo: exit $?"; }
took=$((SECONDS - begin))
ended_us=${EPOCHREALTIME/./}
echo "ok: from the packages to a world that ran for 5 s and lost nothing: $took s"
echo "install_to_world_s $(awk -v us="$((ended_us - begin_us))" 'BEGIN { printf "%.1f", us / 1e6 - 5 }')"  # less the 5 s
[[ $took -le $LONGEST_TO_A_WORLD_S ]] || echo "note: that is more than $LONGEST_TO_A_WORLD_S s; most of it is apt"
for program in tessera tessera-control tessera-agent tessera-region tessera-gateway; do
  [[ $("$program" --version) == *"$(dpkg-query -W -f '${Version}' tessera-cli)"* ]] || fail "$program --version: $("$program" --version)"
done
release=$(tessera-region --version)
release=${release#tessera-region }
kept=/usr/lib/tessera/releases/$release/tessera-region
[[ $kept -ef /usr/bin/tessera-region ]] || fail "the worker's program is not kept as $kept"
getent passwd tessera tessera-control >/dev/null || fail "the users of the services were not made"

# --- Upgrade, removal -------------------------------------------------------------------------------------------------

# As three releases before left them: the one before is kept, an older one only while a worker runs by it.
for before in 0.0.1 0.0.2 0.0.3; do
  install -D "$(command -v sleep)" "/usr/lib/tessera/releases/$before/tessera-region"
done
/usr/lib/tessera/releases/0.0.1/tessera-region 600 &
worker=$!
apt install --no-install-recommends "$PACKAGES"/later/tessera-*.deb
kept=$(find /usr/lib/tessera/releases -mindepth 1 -maxdepth 1 -printf '%f\n' | sort -V | tr '\n' ' ')
[[ $kept == "0.0.1 0.0.3 $release " ]] || fail "the releases that are kept: $kept"
kill "$worker"
echo "ok: the worker's programs of this release, of the one before, and of one that runs are kept"
[[ $(dpkg-query -W -f '${Version}' tessera-agent) == *+later ]] || fail "not upgraded"
as_user tessera -o json demo --seconds 3 --page-listen 127.0.0.1:0 >/tmp/demo.json 2>/tmp/demo.log ||
  { cat /tmp/demo.log >&2; fail "tessera demo after the upgrade: exit $?"; }
echo "ok: upgraded, and the demo runs"

install -d -o tessera -g tessera /var/lib/tessera/agent
install -d -o tessera-control -g tessera-control /var/lib/tessera/control
touch /var/lib/tessera/control/control.db
echo 'TESSERA_CONTROL_FLAGS=' >/etc/default/tessera-control
apt remove tessera-cli tessera-control tessera-agent tessera-gateway
[[ -e /var/lib/tessera/control/control.db ]] || fail "a removal deleted the store"
command -v tessera-control && fail "tessera-control is left after the removal"
echo "ok: removed, and the store is kept"
apt purge tessera-control tessera-agent tessera-gateway
left=$(ours | grep -v -e '^/home/' -e '^/var/log/' || true)
[[ -z $left ]] || fail "left after the purge: $left"
echo "ok: purged, and nothing is left"

# --- The client library -----------------------------------------------------------------------------------------------

apt install --no-install-recommends g++ cmake ninja-build "$PACKAGES"/libtessera-*-dev_*.deb
{ cmake -G Ninja -S /usr/share/tessera/examples -B /tmp/examples && ninja -C /tmp/examples; } >/tmp/examples.log 2>&1 ||
  { cat /tmp/examples.log >&2; fail "the examples do not build against the package"; }
echo '#include "tessera/game.hpp"' | g++ -std=c++17 -fsyntax-only -x c++ - || fail "game.hpp does not compile by itself"
echo "ok: the examples build against libtessera-client-dev, and libtessera-game-dev has its headers"
echo "all held"
