#!/usr/bin/env bash
# try_units.sh PACKAGES FOLDER: tries the units under a real systemd, in a container with no network but its own loopback.
#
# PACKAGES is a folder of packages (./dev package); those of a later version, to upgrade to, are in PACKAGES/later, which
# `./dev package --try` leaves behind. FOLDER is where the container's system lies, for example /var/tmp/tessera-units; if it
# is not there, debootstrap makes it (350 MB from Debian's mirror, two minutes), and apt installs what the packages depend on.
# Needs root, and: apt-get install debootstrap systemd-container
#
# Holds: all services become ready; a host without token says so and stays down; workers, with their pids, outlive the agent's
# restart, SIGKILL, hang (watchdog) and stop, the control plane's restart and SIGKILL, the gateway's restart and SIGKILL, and an
# upgrade of all packages; the next agent adopts them and the world runs on. A removal ends them, and with the package comes the
# world, from its checkpoint. A gateway with a wrong option stays down; it records a world into its own folder, ends the file when
# it is stopped, and answers again after its restart, SIGKILL and upgrade; recordings outlive its removal, and no purge.
# Where this machine has the controllers of memory and tasks in cgroup v2: with the lines of docs/operating.md each worker is in
# a control group of its own, with its limits, which outlives its agent; one beyond its memory is ended alone.
set -euo pipefail

[[ $# -eq 2 ]] || { sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 2; }
PACKAGES=$(realpath -- "$1")
ROOT=$(realpath -m -- "$2")
readonly PACKAGES ROOT

fail() {
  printf 'FAILED: %s\n' "$*" >&2
  inside journalctl --no-pager --output=cat --unit=tessera-agent --unit=tessera-control --unit=tessera-gateway --lines=30 >&2 || true
  exit 1
}

# --- The container ----------------------------------------------------------------------------------------------------

inside() {
  nsenter --target "$INIT" --mount --uts --ipc --net --pid --root --wd \
    env -i PATH=/usr/local/bin:/usr/sbin:/usr/bin HOME=/root "$@"
}

# eventually WHAT COMMAND...: waits, at most 20 s, until COMMAND succeeds.
eventually() {
  local what=$1 _
  shift
  for _ in {1..200}; do
    if "$@" >/dev/null 2>&1; then
      printf 'ok: %s\n' "$what"
      return
    fi
    sleep 0.1
  done
  fail "$what"
}

boot() {
  systemd-nspawn --quiet --directory="$ROOT" --machine=tessera-units --register=no --keep-unit --private-network \
    --console=pipe --boot </dev/null >"$LOG" 2>&1 &
  NSPAWN=$!
  trap 'kill "$NSPAWN" 2>/dev/null; wait "$NSPAWN" || true; rm -f -- "$LOG" "$APT_LOG"' EXIT
  local _
  for _ in {1..200}; do
    INIT=$(pgrep --parent "$NSPAWN" | head -n 1) || true
    if [[ -n $INIT ]] && inside systemctl is-system-running >/dev/null 2>&1; then return; fi
    sleep 0.1
  done
  cat "$LOG" >&2
  fail "the container does not come up"
}

LOG=$(mktemp)
APT_LOG=$(mktemp)
if [[ ! -e $ROOT/etc/debian_version ]]; then debootstrap --include=systemd,systemd-sysv,dbus,procps bookworm "$ROOT"; fi

# in_root COMMAND...: in the container's system while it is not up, with this machine's network.
in_root() { chroot "$ROOT" env -i DEBIAN_FRONTEND=noninteractive PATH=/usr/sbin:/usr/bin:/sbin:/bin "$@"; }
# Removes what an earlier run left; then the packages anew, and what they depend on.
in_root dpkg --purge tessera-cli tessera-control tessera-agent tessera-gateway >"$APT_LOG" 2>&1
rm -rf -- "$ROOT/root/.config/tessera" "$ROOT/etc/credstore/tessera.join-token" "$ROOT/packages"
mkdir "$ROOT/packages"
cp -r -- "$PACKAGES"/tessera-*.deb "$PACKAGES/later" "$ROOT/packages"
apt-config dump | grep -E '^Acquire::' >"$ROOT/etc/apt/apt.conf.d/00host" || true
in_root sh -c 'apt-get -q update && apt-get -q -y install --no-install-recommends /packages/tessera-*.deb' >"$APT_LOG" 2>&1 ||
  { cat "$APT_LOG" >&2; printf 'FAILED: the packages cannot be installed\n' >&2; exit 1; }
boot

# --- What the world looks like ------------------------------------------------------------------------------------------

workers() { inside pgrep --exact tessera-region | sort; }
agent() { inside systemctl show tessera-agent --property=MainPID --value; }
lowest_tick() { inside tessera instance describe inst-1 | awk '$1 ~ /^[0-9]+$/ { print $4 }' | sort -n | head -n 1; }
ticks_beyond() { [[ $(lowest_tick) -gt $1 ]]; }
ready_again() { [[ $(agent) != "$1" && $(agent) != 0 ]] && inside systemctl is-active tessera-agent; }
running() { inside tessera instance list | grep -q 'inst-1 *RUNNING'; }

gateway() { inside systemctl show tessera-gateway --property=MainPID --value; }
another_gateway() { [[ $(gateway) != "$1" && $(gateway) != 0 ]] && inside systemctl is-active tessera-gateway; }
recordings() { inside tessera record list --gateway 127.0.0.1:7710; }
# ended_recordings COUNT: the gateway answers, and lists so many recordings with a length.
ended_recordings() { [[ $(recordings | grep -c '^inst-1-[^ ]* *inst-1 *[0-9.]*s ') -eq $1 ]]; }
record() { inside tessera record start inst-1 --gateway 127.0.0.1:7710 --token-file /root/operator.token; }

# survived WHAT: the same workers as at the start, and their world goes on.
survived() {
  [[ $(workers) == "$WORKERS" ]] || fail "$1: workers were $WORKERS, are $(workers)"
  eventually "$1: the world is RUNNING" running
  eventually "$1: the same workers tick on" ticks_beyond "$(($(lowest_tick) + 60))"
}

# --- The trial ----------------------------------------------------------------------------------------------------------

inside sh -c 'echo "TESSERA_CONTROL_FLAGS=--listen 127.0.0.1:7700" >/etc/default/tessera-control'
inside sh -c 'echo "TESSERA_AGENT_FLAGS=--control 127.0.0.1:7700" >/etc/default/tessera-agent'
inside systemctl start tessera-control || fail "tessera-control is not ready"
echo "ok: tessera-control is ready"
inside tessera --control unix:/var/lib/tessera/control/control.sock cluster init --address 127.0.0.1:7700 ||
  fail "no first administrator"

if inside systemctl start tessera-agent 2>/dev/null; then fail "an agent without token is ready"; fi
inside journalctl --sync
# All of it is read: a journalctl that is cut off by grep would count as failed.
inside journalctl --unit=tessera-agent --output=cat --no-pager | grep 'has not been admitted yet' >/dev/null ||
  fail "an agent without token does not say so"
echo "ok: an agent without token says so and stays down"

inside install -d -m 0700 /etc/credstore
# shellcheck disable=SC2016  # expands inside
inside sh -c 'umask 077; tessera -o json host add here | grep -o "tsj_[0-9a-f.]*" >/etc/credstore/tessera.join-token'
inside systemctl start tessera-agent || fail "tessera-agent is not ready"
inside rm /etc/credstore/tessera.join-token
echo "ok: tessera-agent was admitted and is ready"
inside tessera instance create --scene plaza --regions 4 --wait
WORKERS=$(workers)
[[ $(wc -l <<<"$WORKERS") -eq 4 ]] || fail "not 4 workers: $WORKERS"

before=$(agent)
inside systemctl restart tessera-agent || fail "restart"
[[ $(agent) != "$before" ]] || fail "the agent was not restarted"
survived "agent restarted"

before=$(agent)
inside systemctl kill --signal=KILL --kill-whom=main tessera-agent
eventually "agent killed: another is ready" ready_again "$before"
survived "agent killed"

inside mkdir -p /run/systemd/system/tessera-agent.service.d
inside sh -c 'printf "[Service]\nWatchdogSec=2\n" >/run/systemd/system/tessera-agent.service.d/try.conf'
inside systemctl daemon-reload
inside systemctl restart tessera-agent
before=$(agent)
sleep 5
[[ $(agent) == "$before" ]] || fail "the watchdog of 2 s is not fed"
echo "ok: a watchdog of 2 s is fed"
inside kill -STOP "$before"
eventually "agent hangs: the watchdog makes another ready" ready_again "$before"
survived "agent hung"

inside systemctl stop tessera-agent
[[ $(workers) == "$WORKERS" ]] || fail "agent stopped: workers were $WORKERS, are $(workers)"
inside systemctl start tessera-agent
survived "agent stopped and started"

inside systemctl restart tessera-control
survived "control plane restarted"
inside systemctl kill --signal=KILL tessera-control
eventually "control plane killed: another answers" inside tessera instance list
survived "control plane killed"

inside sh -c 'echo "TESSERA_GATEWAY_FLAGS=--nonsense" >/etc/default/tessera-gateway'
if inside systemctl start tessera-gateway 2>/dev/null; then fail "a gateway with a wrong option is ready"; fi
[[ $(inside systemctl show tessera-gateway --property=NRestarts --value) == 0 ]] || fail "a gateway with a wrong option is started again"
echo "ok: a gateway with a wrong option stays down"
FINGERPRINT=$(inside tessera cluster authority)
# secret_of NAME ROLE: of a new access token.
secret_of() { inside tessera token create "$1" --role "$2" | sed -n 's/^secret (shown once): //p'; }
inside sh -c "umask 077; echo '$(secret_of recorder operator)' >/root/operator.token"
inside sh -c "umask 077; printf '%s\n' 'TESSERA_TOKEN=$(secret_of page viewer)' \
  'TESSERA_GATEWAY_FLAGS=--control 127.0.0.1:7700#$FINGERPRINT --recordings-dir /var/lib/tessera-gateway' >/etc/default/tessera-gateway"
inside systemctl reset-failed tessera-gateway
inside systemctl start tessera-gateway || fail "tessera-gateway is not ready"
echo "ok: tessera-gateway is ready"
eventually "the gateway records the world" record

before=$(gateway)
inside systemctl restart tessera-gateway || fail "restart of the gateway"
[[ $(gateway) != "$before" ]] || fail "the gateway was not restarted"
eventually "gateway restarted: it answers, and the recording was ended" ended_recordings 1
survived "gateway restarted"

before=$(gateway)
eventually "the gateway records the world again" record
inside systemctl kill --signal=KILL tessera-gateway
eventually "gateway killed: another is ready" another_gateway "$before"
eventually "gateway killed: another answers, and has one recording that was ended" ended_recordings 1
survived "gateway killed"

before=$(gateway)
inside sh -c 'dpkg -i /packages/later/tessera-*.deb' >"$APT_LOG" 2>&1 || { cat "$APT_LOG" >&2; fail "upgrade"; }
inside dpkg --status tessera-agent | grep -q '^Version: .*+later$' || fail "not upgraded"
eventually "all packages upgraded: another gateway is ready" another_gateway "$before"
eventually "all packages upgraded: it answers" recordings
survived "all packages upgraded"

inside dpkg --remove tessera-gateway >"$APT_LOG" 2>&1 || { cat "$APT_LOG" >&2; fail "removal of tessera-gateway"; }
if inside systemctl is-active --quiet tessera-gateway; then fail "the gateway outlives the removal of its package"; fi
[[ $(inside find /var/lib/private/tessera-gateway -name 'inst-1-*.rec' | wc -l) -eq 2 ]] || fail "recordings are gone with the package"
inside dpkg --purge tessera-gateway >"$APT_LOG" 2>&1 || { cat "$APT_LOG" >&2; fail "purge of tessera-gateway"; }
if inside test -e /var/lib/private/tessera-gateway; then fail "recordings outlive a purge"; fi
echo "ok: recordings outlive the removal of the gateway, and no purge"

# All its regions die with the host, so the world comes back from a checkpoint.
inside tessera instance checkpoint inst-1
inside dpkg --remove tessera-agent >"$APT_LOG" 2>&1 || { cat "$APT_LOG" >&2; fail "removal of tessera-agent"; }
if workers; then fail "workers outlive the removal of their package"; fi
echo "ok: a removal ends the workers"
inside sh -c 'dpkg -i /packages/later/tessera-agent_*.deb' >"$APT_LOG" 2>&1 || { cat "$APT_LOG" >&2; fail "installation after a removal"; }
inside systemctl start tessera-agent
eventually "installed again: the world is RUNNING" running

inside tessera instance delete inst-1 --wait
if workers; then fail "workers are left"; fi

# --- Control groups -----------------------------------------------------------------------------------------------------

# drop_in: the lines that docs/operating.md gives for `systemctl edit tessera-agent`.
drop_in() {
  awk '/systemctl edit tessera-agent/ { near = 1 } near && /^```ini/ { lines = 1; next } /^```/ { if (lines) exit } lines' \
    "$(dirname -- "${BASH_SOURCE[0]}")/../../docs/operating.md"
}
# limit PID FILE: of the control group of a process.
limit() { inside sh -c "cat /sys/fs/cgroup\$(sed -n 's/^0:://p' /proc/$1/cgroup)/$2"; }
group() { inside sed -n 's/^0:://p' "/proc/$1/cgroup"; }

# grouped WHAT: the agent is in a group of its own, and each worker in another, with its limits.
grouped() {
  local pid
  [[ $(group "$(agent)") == */tessera-agent.service/agent ]] || fail "$1: the agent is in $(group "$(agent)")"
  for pid in $(workers); do
    [[ $(group "$pid") == */tessera-agent.service/worker-* ]] || fail "$1: a worker is in $(group "$pid")"
    [[ $(limit "$pid" memory.max) == $((2048 << 20)) ]] || fail "$1: a worker has memory.max $(limit "$pid" memory.max)"
    [[ $(limit "$pid" pids.max) == 128 ]] || fail "$1: a worker has pids.max $(limit "$pid" pids.max)"
  done
  [[ $(for pid in $(workers); do group "$pid"; done | sort -u | wc -l) -eq $(workers | wc -l) ]] || fail "$1: workers share a group"
  echo "ok: $1: each worker is in a group of its own, with its limits"
}
replaced() { inside tessera instance list | grep -q 'inst-2 *RUNNING' && [[ $(workers | wc -l) -eq 4 ]] && ! inside test -e "/proc/$1"; }

CONTROLLERS=" $(inside cat /sys/fs/cgroup/cgroup.controllers 2>/dev/null || true) "
if [[ $CONTROLLERS == *" memory "* && $CONTROLLERS == *" pids "* ]]; then
  [[ $(drop_in) == *Delegate=* ]] || fail "docs/operating.md has no lines for control groups"
  inside mkdir -p /etc/systemd/system/tessera-agent.service.d
  drop_in | inside tee /etc/systemd/system/tessera-agent.service.d/groups.conf >/dev/null
  inside sh -c 'echo "TESSERA_AGENT_FLAGS=--control 127.0.0.1:7700 --worker-cgroups on --worker-memory-mb 2048 --worker-tasks 128" \
    >/etc/default/tessera-agent'
  inside systemctl daemon-reload
  inside systemctl restart tessera-agent || fail "restart with control groups"
  inside tessera instance create --scene plaza --regions 4 --wait
  WORKERS=$(workers)
  grouped "control groups"
  before=$(agent)
  inside systemctl restart tessera-agent || fail "another restart with control groups"
  [[ $(agent) != "$before" && $(workers) == "$WORKERS" ]] || fail "control groups: workers were $WORKERS, are $(workers)"
  grouped "agent restarted"
  before=$(agent)
  inside systemctl kill --signal=KILL --kill-whom=main tessera-agent
  eventually "agent killed: another is ready" ready_again "$before"
  grouped "agent killed"
  # On one host nobody carries a region on, so the world comes back from a checkpoint.
  inside tessera instance checkpoint inst-2
  victim=$(head -n 1 <<<"$WORKERS")
  before=$(agent)
  inside sh -c "echo 4M >/sys/fs/cgroup$(group "$victim")/memory.max" || true
  eventually "a worker beyond its memory is ended, and the world comes back" replaced "$victim"
  [[ $(agent) == "$before" ]] || fail "the agent ended with the worker"
  inside grep -qx 'oom_group_kill 1' /sys/fs/cgroup/system.slice/tessera-agent.service/memory.events ||
    fail "memory ended other groups than that worker's"
  grouped "after that"
  inside tessera instance delete inst-2 --wait
else
  echo "skipped: control groups of workers, for cgroup v2 here has no controllers of memory and pids"
fi
echo "all held"
