// Limits and defaults of the control plane: each with its unit, its reason and what breaks if it changes.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include "control_plane/guest_rates.h"
#include "core/world/limits.h"
#include "trust/message_size.h"

namespace tessera::control {

// Settings that an operator may change. Spans are counted on the steady clock.
struct ControlSettings {
  // How often an agent says that it lives; it learns this on admission.
  std::chrono::milliseconds heartbeat_interval{250};
  // Silence of a host, and of its regions towards their standbys, after which others carry its regions on. It is four
  // heartbeats: shorter, and a busy machine loses healthy workers; each 100 ms more is 100 ms more without that part of
  // the world.
  std::chrono::milliseconds failover_after{1000};
  // How long a failover may take until every live region has answered. One that does not answer is worse than dead: the
  // others stand still for it.
  std::chrono::milliseconds failover_timeout{15'000};
  // How long a failover waits instead for a worker that may live, and that nobody but its silent host could ask, where
  // the world has no checkpoint to go back to. An agent that crashed, or a network between machines, is mended within
  // minutes: shorter, and worlds are given up for what passes; longer, and whoever waits to begin another one learns
  // late that this one is lost.
  std::chrono::milliseconds silence_patience{600'000};
  // Silence after which a host is LOST. It is twenty heartbeats: shorter, and a paused virtual machine degrades its
  // instances.
  std::chrono::milliseconds lost_after{5000};
  // How long a link between two regions stays cut after the world is DEGRADED for it, until one of the two is moved. A
  // link that breaks is dialled again within two seconds and a network that finds another way takes some more: shorter,
  // and worlds move for what passes; longer, and players see for longer a world whose halves do not touch.
  std::chrono::milliseconds move_cut_after{5000};
  // How long an instance may be STARTING (or PLACING) before it is given up. A scene of a million bodies loads in
  // seconds; hosts that are busy or slow to read a large level need more.
  std::chrono::milliseconds start_timeout{60'000};
  // How long a worker may take to end in order before its agent has to end it.
  std::chrono::milliseconds stop_grace{10'000};
  // How long instances that have ended stay listed.
  std::chrono::milliseconds keep_ended{3'600'000};
  // How long a player who has left stays in the orders after all workers know, so that a late grant of the body is
  // still met by someone who knows that the player has left.
  std::chrono::milliseconds keep_left_players{60'000};
  // Bytes that the kept checkpoints of one world may take; 0: as many as they need.
  std::uint64_t checkpoint_quota = 0;
  // Bytes that all files of meshes may take; 0: none is taken, and scenes may refer to any.
  std::uint64_t visual_quota = 1'000'000'000;
  // How long a file of meshes stays that no instance needs: the time from its upload to the instance, and from one
  // instance of a level to the next. Shorter, and a level that is changed and tried again is sent anew each time.
  std::chrono::milliseconds keep_visuals{900'000};
  // At the start, records that an earlier start has set aside as unreadable are deleted.
  bool drop_set_aside = false;
  // How often strangers may join without a ticket.
  GuestLimits guests{};
  // This program's, "0.1.0": agents of releases further away are refused (release.h). Empty: none is.
  std::string release;
};

// A worker may step so long after it asked for its lease, and stands still thereafter. The same in region_worker.
inline constexpr std::chrono::milliseconds kLeaseTtl{1000};
// How much slower than ours a worker's clock may run within a TTL: 1 in 20, far beyond any quartz.
inline constexpr std::chrono::milliseconds kLeaseDrift{50};
// How long one of several control planes waits for the proof that it leads, on which it renews leases: a member of etcd
// that hangs costs so much, and is then passed over. Longer, and what comes is worth little, since a lease counts from
// when it was asked for; shorter, and a slow etcd renews none.
inline constexpr std::chrono::milliseconds kLeaseProofPatience{500};
// Time from one proof to the next: at most so many reads of etcd, however many hosts ask. Longer, and each lease comes
// later.
inline constexpr std::chrono::milliseconds kLeaseProofInterval{20};
// Time from one message or timer call to the next, beyond which it is this process that has stood still, not its hosts;
// and from one host's message to the next of any, beyond which it is this process that was cut off.
inline constexpr std::chrono::milliseconds kOwnPause{500};
// Changes of properties of one instance that wait for an answer: each is in the orders of all its workers.
inline constexpr std::size_t kMaxPropertyChanges = 1000;
inline constexpr int kMaxEvents = 32;  // kept for an instance

// Time from the announcement of a planned map to its tick, beside the ticks of its flood: two messages to the slowest
// worker and back. Shorter, and a plan is put off; longer, and every change takes longer.
inline constexpr std::chrono::milliseconds kPlanLead{400};
// Time between two changes of one instance that nobody asked for: step times are those of the last few seconds.
inline constexpr std::chrono::milliseconds kBalanceInterval{1000};
// How long a region may be without a standby that takes its log until another one is planned: a new standby has its
// copy within a second. And how long those two are then kept apart.
inline constexpr std::chrono::milliseconds kStandbyPatience{5000}, kCutKept{60'000};
// How long a region may go without a step that anybody knows of, beyond the half second between reports, and two
// neighbours without a link, until the world is DEGRADED for it. Shorter, and a busy machine degrades worlds that are
// well; longer, and a world that stands still is called RUNNING.
inline constexpr std::chrono::milliseconds kStillAfter{2000}, kCutAfter{5000};
// The same of a region of which no step is known since this control plane began, from its first look at the world: a
// region may have stood before that, so two timers later than this RUNNING would be false for 2 s. Shorter, and an
// ordinary restart, after which agents attach within a second or so and report twice in another half, degrades worlds
// that are well.
inline constexpr std::chrono::milliseconds kNotKnownAfter{1700};
// Wait after a change that could not be made, for want of room or because a newcomer died.
inline constexpr std::chrono::milliseconds kChangeRetry{5000};
// How long a planned map that all know waits, in all its tries together, for a newcomer's links to its neighbours,
// until it is taken back; and from then to the next try. A link takes two messages to and fro. Shorter, and a busy
// machine stops changes; longer, and an operator learns late that no release of the two understands the other.
inline constexpr std::chrono::milliseconds kNewcomerLinkPatience{10'000}, kUnlinkedRetry{60'000};
// How long a checkpoint may take from the choice of its tick until all files are on the disk, and the wait before
// another try. A region of 10000 bodies writes some MB.
inline constexpr std::chrono::milliseconds kCheckpointTimeout{30'000}, kCheckpointRetry{5'000};
// A world that is to be upgraded stands by then, or goes on.
inline constexpr std::chrono::seconds kUpgradePatience{30};
inline constexpr std::chrono::milliseconds kDefaultCheckpointInterval{60'000};
inline constexpr std::chrono::milliseconds kMinCheckpointInterval{5'000}, kMaxCheckpointInterval{24 * 3'600'000};
inline constexpr std::uint32_t kDefaultKeptCheckpoints = 3, kMaxKeptCheckpoints = 100;
inline constexpr std::chrono::milliseconds kDefaultLeaverGrace{60'000}, kMaxLeaverGrace{24 * 3'600'000};
// One piece of a streamed file, and the largest file, bytes: a region of a million bodies.
inline constexpr std::size_t kPieceBytes = 1 << 20, kMaxStateBytes = std::size_t{512} << 20;

// The busiest region's step time by the mean above which borders are moved, and how far at most, as a share of the
// heavier side's extent. Lower or larger: bodies change hands for noise.
inline constexpr double kBalanceAbove = 1.2, kBalanceStep = 0.5;

// Time from one region that is moved for its slow host, or for a cut link, to the next of the same world for the same
// cause. Shorter, and regions are carried to and fro between hosts that are bad in turn.
inline constexpr std::chrono::milliseconds kMovedRegionInterval{600'000};

// A body of a slow host costs this much more than one elsewhere, the steps of its region are longer than a tick, and
// both last so long, until the region is moved; the next one not sooner than the interval. A cost nearer to 1, or a
// shorter time, and worlds move for what passes; a longer one, and players feel a slow machine for longer.
inline constexpr double kSlowHostCost = 1.5;
inline constexpr std::chrono::milliseconds kSlowHostAfter{15'000}, kSlowHostInterval = kMovedRegionInterval;

// For how long regions are not placed on a host on which a worker found no free ports, while another has room. Shorter,
// and each failover begins with a worker that dies there; longer, and the host stays empty when its ports are free.
inline constexpr std::chrono::milliseconds kNoPortsInterval = kMovedRegionInterval;

// How long a change may be held up by bodies that wait for a cut link, until the region that has them is carried on by
// its standby. Without a cut they are handed over within a second; with one, those that come back by themselves, or
// reach a third region, take some more. Shorter, and a failover stops a world that is almost done; longer, and a world
// of two regions, where none comes back, is in two halves for longer.
inline constexpr std::chrono::milliseconds kCutChangePatience{5000};

// Most instances that have ended and are kept; the oldest go first.
inline constexpr std::size_t kMaxEndedInstances = 1000;

// Start deadline of an instance: default and largest.
inline constexpr std::chrono::milliseconds kDefaultStartDeadline{30'000};
inline constexpr std::chrono::milliseconds kMaxStartDeadline{24 * 3'600'000};
inline constexpr std::uint32_t kDefaultSnapshotRateHz = 30;

// Missed heartbeats (the hello counts as one) after which a worker that its agent no longer names is taken as dead.
// More than one: an agent that has just started names its workers as it finds them.
inline constexpr int kMissedBeforeVanished = 3;

inline constexpr std::size_t kMaxNameBytes = 63;        // a host's: a DNS label
inline constexpr std::size_t kMaxEndReasonBytes = 200;  // why a game refused or kicked a player
inline constexpr std::size_t kMaxRequestIdBytes = 128;
inline constexpr std::size_t kMaxAddressBytes = 253;  // a DNS name
// Largest join token or host's secret: ours have 68 bytes. A longer one is refused before it is hashed.
inline constexpr std::size_t kMaxSecretBytes = 256;
// Workers that one message of an agent may name: as many as a host may run, and as many again that are to end.
inline constexpr std::size_t kMaxNamedWorkers = 2 * std::size_t{kMaxRegions};
// A certificate request of a P-256 key, PEM: ours have some 400.
inline constexpr std::size_t kMaxCertificateRequestBytes = 4096;
inline constexpr std::int32_t kDefaultPageSize = 100, kMaxPageSize = 1000;
inline constexpr std::size_t kMaxReasonBytes = 600;  // one line of a terminal, or a few
inline constexpr std::size_t kReasonLogLines = 3;

// Largest message, bytes: a scene of a million scattered-out bodies is about 100 MB as text, 64 MB on the wire.
inline constexpr int kMaxMessageBytes = trust::kMaxMessageBytes;
// Shortest time between two pushes of a watched instance whose state is the same, so that reports do not become a
// flood.
inline constexpr std::chrono::milliseconds kWatchInterval{100};
// How long JoinInstance waits until the workers know the new player, so that its client is not refused by a region that
// has not heard. After that the answer goes out; the client then has to try again where it is refused.
inline constexpr std::chrono::milliseconds kPlayerKnownTimeout{2000};
// How long a change of a property waits for the owner of its body: longer than a failover takes.
inline constexpr std::chrono::milliseconds kPropertyTimeout{10'000};
// How long a control plane that begins from a backup waits for its hosts to say what they run: agents dial again within
// seconds. A host that comes later finds what it runs declared dead, once its silence has been long enough for that.
inline constexpr std::chrono::milliseconds kRecoverPatience{30'000};
// Exits and inventories that are kept meanwhile: one each of the workers of a cluster of thousands.
inline constexpr std::size_t kMaxHeldBack = 20'000;
// How often deadlines are checked. No command waits for it.
inline constexpr std::chrono::milliseconds kTimerInterval{100};

// How often the log says how far something is that takes long: a restore, a failover, a change, a start. More often,
// and a world that waits for room fills the log.
inline constexpr std::chrono::milliseconds kProgressInterval{60'000};

// How long a question waits for the cluster until it is answered from the picture that is kept of it while writes are
// slow; and how long the last write took if they are. A picture costs some 10 ms in a cluster of a thousand worlds:
// shorter, and it is made for nothing; longer, and whoever looks waits for longer.
inline constexpr std::chrono::milliseconds kQuestionPatience{100}, kSlowWrite{100};

// A timer that stands still for so long does not come back by itself: what it waits for, a write to the store or a
// file, takes seconds at the worst.
inline constexpr std::chrono::milliseconds kTimerPatience{15'000};

// Lines of an instance's game that are kept in memory, and bytes of one. More cost memory in each instance that logs.
inline constexpr std::size_t kMaxGameLines = 1000, kMaxGameLineBytes = 600;
// How long a game must not have failed for its next error to be an event of the instance. Shorter, and a game that
// fails now and then drives all other events out.
inline constexpr std::chrono::milliseconds kGameErrorSilence{60'000};
// Callbacks that are off and become events, of an instance while this process runs; a host that reports more is broken.
inline constexpr int kMaxCallbacksOff = 100;

// Workers of a world that may die in its native game in a row, and how many seconds of the world's own time have to
// pass for the next one to be the first again. It is the default interval of checkpoints: a world that goes back to one
// comes to the same crash within that. Fewer deaths, and one accident ends a world; more, and more hosts see the crash.
inline constexpr int kMaxGameDeaths = 3;
// A world that is lost again within so many seconds of its own time after it began from a checkpoint was lost for what
// is in it, perhaps; after so many times an older one is taken, and without an older one the world stops.
inline constexpr std::uint32_t kMaxRestoresOfOne = 2;
inline constexpr std::chrono::seconds kRestoreForgiven{10};
inline constexpr std::chrono::seconds kGameDeathForgiven{60};

// Published events that are kept of an instance, in the store and in memory: some 6 MB where all are as large as can
// be. A backend that was away for longer than they took to come misses some, and learns of it.
inline constexpr std::size_t kMaxPublishedKept = 10'000;
// Events that one report may bring; the rest comes with the next.
inline constexpr std::size_t kMaxPublishedTaken = 1'024;
// Events that are given to a backend at a time.
inline constexpr std::size_t kPublishedAtOnce = 256;
// Messages of a backend to one instance that no region has answered.
inline constexpr std::size_t kMaxGameMessages = 64;
// Requests of an instance whose ids are known. A backend that makes one again after so many others sends it twice.
inline constexpr std::size_t kMaxGameRequestsKept = 4'096;
// After so long a message whose target no region has counts as refused.
inline constexpr std::chrono::milliseconds kGameMessagePatience{600'000};

// How long a ticket's number is remembered after it was shown: until each copy of it, and of those before it, has run
// out whichever way the clocks are off (kMaxTicketLifetime + 2 kTicketLeeway, trust/ticket.h). Shorter, and a copy is
// worth something again.
inline constexpr std::chrono::milliseconds kTicketMemory{600'000};
// Players whose tickets are remembered: some 30 MB, and 160 new ones a second for ten minutes on end.
inline constexpr std::size_t kMaxUsedTickets = 100'000;
inline constexpr std::size_t kTicketsForgottenAtOnce = 256;  // in one write
inline constexpr char kKickedReason[] = "kicked by an operator", kBannedReason[] = "banned by an operator";
inline constexpr std::size_t kMaxBans = 10'000;  // in a cluster, its instances' among them
// Access tokens and issuers that the list of revocations names: some 120 KB of its 1 MiB. Those beyond are revoked all
// the same, and a backup from before would bring them back.
inline constexpr std::size_t kMaxRevokedTokens = 2'000, kMaxRevokedIssuers = 500;
// How long a player may take at least from its join to its first connection; a longer grace of the instance holds.
// Shorter, and who loads a large scene over a slow line is gone before it comes.
inline constexpr std::chrono::milliseconds kFirstConnectionGrace{60'000};
// So many numbers of players are reserved in the record of a world by one write, and lost to its next life where they
// were not given. More, and a number is lost for nothing; fewer, and the whole record is written more often.
inline constexpr std::uint32_t kNumbersAtOnce = 64;

// How often all players of a world are looked at for who vanished, where nobody else connected or left. Longer, and a
// grace is longer by as much; shorter, and each of many joins looks at ten thousand.
inline constexpr std::chrono::milliseconds kVanishedInterval{50};

// Files of meshes that one scene may refer to, and that one request may ask for: `tessera scene import` makes one.
inline constexpr std::size_t kMaxVisualFiles = 256;
// One piece of such a file on its way, and in the store. The latter is the most that is held of a file that is sent,
// and written in one transaction: larger, and other writes wait longer for it.
inline constexpr std::size_t kVisualPieceBytes = 64 << 10, kVisualStoredBytes = 1 << 20;
// Pause between two pieces that are written: whoever waits for the store has its turn.
inline constexpr std::chrono::milliseconds kVisualPause{2};
// How often it is looked which files nothing needs.
inline constexpr std::chrono::milliseconds kVisualSweepInterval{1000};

// Large scenes that were uploaded wait on the disk for the requests that make worlds of them: so many bytes of all, and
// so long. Less, and two who make worlds of different levels at once are in each other's way.
inline constexpr std::uint64_t kWaitingScenesBytes = std::uint64_t{1} << 30;
inline constexpr std::chrono::minutes kWaitingSceneGrace{15};

inline constexpr std::uint32_t kMaxPort = 65535;

}  // namespace tessera::control
