// Limits and defaults of the agent, each with its unit, its reason, and what breaks if it changes.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "net/token_bucket.h"

namespace tessera::agent {

using Clock = std::chrono::steady_clock;
using TimePoint = Clock::time_point;
using Duration = Clock::duration;

// A worker that starts dials its agent before anything else; one that has not after this long hangs.
inline constexpr Duration kAttachTimeout = std::chrono::seconds(10);
// From the order to stop to SIGTERM, and from SIGTERM to SIGKILL. A worker ends within a few ticks; the sum must stay
// below what `tessera up` and systemd wait for this program (15 s and 90 s).
inline constexpr Duration kStopPatience = std::chrono::seconds(5);
inline constexpr Duration kTermPatience = std::chrono::seconds(3);
// How long an agent that found workers by their processes waits for them to attach, before it dials the control plane:
// until then it knows nothing but that they run, and the control plane would take that for worlds that stand. Workers
// dial again within a second; longer, and the host is LOST.
inline constexpr Duration kFoundPatience = std::chrono::seconds(2);
// Exit code of a worker that could not bind one of its ports, and how many other ports it is then tried with.
inline constexpr int kExitPortInUse = 98;
inline constexpr int kPortAttempts = 16;
// Game (UDP), region link (UDP), metrics (TCP).
inline constexpr std::uint32_t kPortsPerWorker = 3;

// Threads of a worker: it has one for steps, some for games, metrics and logs, and as many again as a machine has
// processors where regions step in parallel. Fewer, and a large machine's workers do not start.
inline constexpr std::uint32_t kUsualWorkerTasks = 512, kMostWorkerTasks = 32'768;

// Between attempts to reach the control plane: doubles from the first to the last, each shortened by up to a fifth at
// random, so that a thousand agents do not come back in one wave.
inline constexpr Duration kFirstBackoff = std::chrono::milliseconds(50);
inline constexpr Duration kLastBackoff = std::chrono::seconds(2);
// An attempt to reach the control plane, from dialling to its first answer.
inline constexpr Duration kAdmissionTimeout = std::chrono::seconds(10);
// A connection to a host that vanished without a word is given up after the sum of these two.
inline constexpr int kKeepaliveTime_ms = 10'000, kKeepaliveTimeout_ms = 5'000;
// The same with several control planes, one of which can take over from a leader that fell silent. The control plane
// takes pings from 1 s on.
inline constexpr Duration kLeaderAdmissionTimeout = std::chrono::seconds(2);
inline constexpr int kLeaderKeepaliveTime_ms = 1'100, kLeaderKeepaliveTimeout_ms = 900;
// How often the agent looks whether its certificate is to be replaced: a share of its life, and once an hour at least.
// A renewal that did not come is asked for again after another share.
inline constexpr Duration kCertificateLook = std::chrono::hours(1);
inline constexpr double kLeastLook = 1.0 / 90, kRenewalRetry = 1.0 / 30;
// The control plane may ask for heartbeats in this range. More often, they cost more than they report.
inline constexpr std::uint32_t kMinHeartbeat_ms = 20, kMaxHeartbeat_ms = 60'000;
// Last words on a stream (what just ended) before this program exits; the other side may be gone.
inline constexpr Duration kFarewell = std::chrono::milliseconds(500);

// From a call for a file that failed, though the stream stands, to the next: the control plane is under load.
inline constexpr Duration kFetchRetry = std::chrono::milliseconds(500);
// A scene or a game that no order has named for so long is removed from the disk; how often the agent looks, at how
// many files at most, and how many it removes in one look, so that nothing else waits for that. Kept shorter, and a
// world that is begun again, or goes back to the game before, fetches them anew; longer, and a host that runs many
// levels fills up.
inline constexpr Duration kContentKept = std::chrono::hours(1), kContentLook = std::chrono::minutes(10);
inline constexpr std::size_t kContentsLookedAt = 4096, kContentsRemovedAtOnce = 64;
// How often the log says that a file is still being fetched.
inline constexpr Duration kProgressInterval = std::chrono::minutes(1);
// One call for a scene, and the largest message (a scene with its meshes, a set of orders with their maps).
inline constexpr Duration kFetchTimeout = std::chrono::seconds(30);
inline constexpr int kMaxMessageBytes = 256 << 20;
// A worker says so much at once, at the most: an inventory of a million bodies is some 20 MB, a report that lists ten
// thousand players 30 KB. The control plane's stream takes 64 MiB, and one that says more would take all others of its
// host from it.
inline constexpr int kMaxWorkerMessageBytes = 32 << 20;
inline constexpr std::size_t kMaxReportBytes = std::size_t{2} << 20;
// And so much over time: a report when something changed, at most one a tick, and leases. Lower, and a busy worker's
// connection is ended, for which it dials anew; higher, and one that was taken over takes the others' time.
inline constexpr net::Rate kWorkerMessages{.per_s = 1000, .burst = 5000};
inline constexpr net::Rate kWorkerBytes{.per_s = 16.0 * 1024 * 1024, .burst = 128.0 * 1024 * 1024};

// The files of the state folder: host.json is small, workers.json grows with workers and what they report. Above, the
// file was not written by an agent.
inline constexpr std::size_t kMaxStateFileBytes = 64 << 20;
// A join token is one line.
inline constexpr std::size_t kMaxTokenBytes = 4096;

// A region's state as a file, in pieces of so many bytes: that of a million bodies.
inline constexpr std::size_t kPieceBytes = 1 << 20, kMaxStateBytes = std::size_t{512} << 20;

// Lines of an ended worker's log that the agent reports.
inline constexpr std::size_t kLastLines = 20;
// Log files of workers that have ended; the oldest go first.
inline constexpr std::size_t kKeptLogs = 200;

// How often the folder of native games is looked through: an operator who puts one there waits so long. And how long
// one may take to load when it is looked at for the first time; the agent does not begin before.
inline constexpr std::chrono::milliseconds kModuleScanInterval{2000}, kModulePatience{10'000};

// Address space of a worker that runs anything: stacks and arenas of its threads are reserved, and hardly used. Less,
// and a small world's worker ends for want of it.
inline constexpr std::uint64_t kLeastWorkerMemory_mb = 4096, kMostDefaultMemory_mb = 16'384;

// An order of which the players alone changed is written to the disk so much later at most. Longer, and more joins are
// missing where agent and control plane are both lost; shorter, and a world of ten thousand is written more often.
inline constexpr std::chrono::milliseconds kKeepPlayersInterval{1000};

// Ticks of workers are written to the disk so often at most, beside what is written for a change of theirs. After all
// machines of a cluster lost power nothing else says how far its worlds were: longer, and more of the time that was
// lost is not counted; shorter, and a host with many workers writes all day.
inline constexpr Duration kKeepTicksInterval = std::chrono::seconds(5);

// A file of the state folder that could not be written is tried again so much later.
inline constexpr Duration kSaveRetry = std::chrono::seconds(1);

// Connections to the socket of workers: of one process, which dials anew before the old one is given up, and in all.
// Beyond, they are closed unread: a worker that was taken over would exhaust this program's descriptors.
inline constexpr std::size_t kConnectionsOfAProcess = 8, kConnectionsOfAll = 4096;
// A worker has one stream; one that comes again may overlap with it.
inline constexpr int kStreamsOfAConnection = 4;
// Where this program has no descriptor left, it looks again so much later.
inline constexpr int kAcceptPause_ms = 100;

// The kernel's sun_path is 108 bytes with its final zero.
inline constexpr std::size_t kMaxSocketPath = 107;

inline constexpr std::uint32_t kRegionsPerCore = 8;

}  // namespace tessera::agent
