// Inside of SnapshotSender: what one client was sent, and what it is to be sent next. Not for others.
//
// The sender has an Entity for each body that the client sees. Most of them rest: the client has acknowledged their
// present state. The others also have a DirtyEntity, and a Write looks only at those whose turn it may be. An entity
// becomes dirty when the history lists its slot as dirty, and clean when the client has acknowledged its newest state.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "core/replication/datagram_writer.h"
#include "core/replication/interest.h"
#include "core/replication/record_cache.h"
#include "core/replication/send_turn.h"
#include "core/replication/snapshot_history_impl.h"
#include "core/replication/snapshot_sender.h"

namespace tessera::replication {

// The records of a body that the client has acknowledged.
struct Acknowledged {
  Stamp tick = 0;        // newest record's; 0: none
  Stamp properties = 0;  // newest record's with properties; 0: none
  // Ticks from that record back to the one acknowledged before, and from there to the one before that; 0: of no use.
  std::uint8_t gap = 0, gap2 = 0;
  std::uint8_t unanswered = 0;  // records sent since the last acknowledgement
};

// A body that the client sees.
struct Entity {
  static constexpr std::uint32_t kClean = 0xffffffff;

  BodyId id;
  Acknowledged acknowledged;  // while it is dirty, its DirtyEntity has the valid one
  Epoch epoch;
  SlotIndex slot = 0;
  std::uint32_t generation = 0;  // the slot's when the body appeared
  std::uint32_t dirty = kClean;  // index of its DirtyEntity
  bool used = false;
};

// An entity whose present state the client may not have.
// By the time that a client's turn comes again others have filled the caches with their data. So the entities that are
// looked at each time take half a cache line each and stand together, apart from the many more that rest.
struct alignas(32) DirtyEntity {
  enum class Use : std::uint8_t {
    kFree,
    kSeen,
    kGone,  // the client does not see it any more
  };
  Acknowledged acknowledged;
  Stamp sent = 0;  // tick of the newest record; 0: none was sent
  SlotIndex slot = 0;
  std::uint32_t entity = 0;          // index
  std::uint32_t first_sequence = 0;  // acknowledgements of earlier datagrams belong to another entity
  std::uint16_t since_push = 0;      // low bits of the number of the push at which it was sent or became dirty
  bool repeated = false;             // the present state was sent more than once
  Use use = Use::kFree;
};
static_assert(sizeof(DirtyEntity) == 32);

// The free indices of an array. The lowest are taken first, so that those in use stay close together.
class FreeIndices {
 public:
  // False: all are in use.
  bool Take(std::uint32_t& index) {
    for (; first_ < words_.size(); ++first_) {
      if (words_[first_] == 0) continue;
      index = static_cast<std::uint32_t>(64 * first_) + static_cast<std::uint32_t>(std::countr_zero(words_[first_]));
      words_[first_] &= words_[first_] - 1;
      return true;
    }
    return false;
  }
  void Give(std::uint32_t index) {
    const std::size_t word = index / 64;
    if (word >= words_.size()) words_.resize(word + 1);
    words_[word] |= std::uint64_t{1} << index % 64;
    first_ = std::min(first_, word);
  }

 private:
  std::vector<std::uint64_t> words_;
  std::size_t first_ = 0;  // those before it are 0
};

// A departure that the client has not acknowledged yet.
struct PendingDeparture {
  DepartureRecord record;
  std::uint32_t first_sequence = 0;
  std::optional<Tick> sent;
};

struct SentDatagram {
  Tick tick;
  std::vector<std::uint32_t> bodies;  // indices of dirty entities, each with kWithProperties or without
  std::vector<BodyId> departures;
};

struct SnapshotSender::Impl {
  using History = SnapshotHistory::Impl;

  explicit Impl(const SnapshotSettings& settings_in) : settings(settings_in), writer(settings.max_datagram_bytes) {}

  WrittenSnapshot Write(History& history, const ClientView& view, std::uint32_t last_input, std::int32_t margin);
  absl::Status Acknowledge(std::uint32_t newest, std::uint64_t mask);
  void Prefetch() const;

  void MoveOrigin(std::uint64_t origin);

  // Entities: which bodies the client sees, and which of them are dirty.
  void Follow(const History& history, const ClientView& view);
  void ChangeViewer(const ClientView& view);
  void ConsiderDirty(const History& history, std::span<const std::uint32_t> cells);
  void ConsiderMembers(const History& history, const std::vector<std::uint32_t>& cells);
  void Consider(const History& history, SlotIndex slot);
  void Appear(const History& history, SlotIndex slot);
  void Depart(const History& history, std::uint32_t index);
  void MarkDirty(const History& history, std::uint32_t index);
  void MarkClean(std::uint32_t dirty_index);
  void SortDirtyList();

  // Its slot stands here too, so that both can be prefetched before either is looked at.
  struct DirtyRef {
    BodyId id;
    std::uint32_t dirty;
    SlotIndex slot;
  };

  // Writing: the due entities, those of them that the budget holds, and the datagrams.
  struct Candidate {
    BodyId id;
    std::uint32_t dirty = 0;
    float distance_squared = 0;                        // Viewer::DistanceSquared
    std::uint32_t priority = 0;                        // in 1 / kPriorityUnit of one that is due at the next snapshot
    RecordCache::Place place = RecordCache::kNowhere;  // its record, once it was looked up
    RecordCache::Key key;
    bool repeated = false;        // the present state was sent before
    bool new_properties = false;  // the client lacks the newest
  };
  void FindCandidates(const History& history, const ClientView& view);
  bool Look(const History& history, const Viewer& viewer, DirtyRef at, Candidate& candidate);
  float ScoreOf(const Candidate& candidate) const;
  void SortByScore(std::size_t most);
  void Thin(std::size_t due, std::size_t deferred, bool much_left);
  void Ask(const History& history, std::size_t i);
  int Pick(History& history, const ClientView& view, float near, const Candidate& candidate);
  void DropLeast(double bits);
  void Choose(History& history, const ClientView& view, WrittenSnapshot& result);
  static RecordCache::Key KeyFor(const History& history, const DirtyEntity& body);
  std::vector<DepartureRecord> DueDepartures(const History& history);
  void Remember(std::span<WrittenDatagram> datagrams, Tick tick, WrittenSnapshot& result);
  void EarnBudget(const History& history, const ClientView& view);
  void ForgetOldest();

  // Acknowledgements.
  std::uint64_t NewlyAcknowledged(std::uint32_t newest, std::uint64_t mask);
  void AcknowledgeDatagram(std::uint32_t sequence);
  void AcknowledgeBody(std::uint32_t body, std::uint32_t sequence, Stamp tick);

  SnapshotSettings settings;
  InterestWindow window;
  std::optional<Vec3d> centre;  // the view's, at the last snapshot
  BodyId own;                   // the view's own body
  TeamId team = 0;
  std::uint64_t pushes_seen = 0;
  std::vector<Entity> entities;
  std::vector<std::uint32_t> free_entities;
  absl::flat_hash_map<SlotIndex, std::uint32_t> by_slot;  // to the index of the entity
  std::vector<DirtyEntity> dirty;
  std::vector<SendTurn> turns;  // those in `dirty`, by the same index
  FreeIndices free_dirty;
  // The dirty entities: ascending by id but for the newest, which stand at the end.
  std::vector<DirtyRef> dirty_list;
  std::size_t sorted_dirty = 0;  // so many of the list are in order
  absl::btree_map<BodyId, PendingDeparture> pending_departures;

  std::deque<SentDatagram> sent;  // the last one has the sequence next_sequence - 1
  // The newest acknowledgement; its datagrams need no second look.
  std::uint32_t acknowledged_newest = 0;
  std::uint64_t acknowledged_mask = 0;
  std::uint32_t next_sequence = 1;
  std::uint64_t origin = 0;        // the history's origin of stamps
  double round_trip_ticks = 6;     // smoothed
  std::uint64_t repeat_after = 0;  // ticks; a record sent more recently cannot have been acknowledged yet
  double allowance_bytes = 0;
  // How much less often what is not near is sent than the viewer says, as a power of two; and for how many snapshots
  // there has been too much, or room.
  std::uint32_t thinning = 0, crowded_for = 0, idle_for = 0;
  // The head of the datagram written last.
  std::optional<Tick> sent_tick;
  std::uint32_t sent_input = 0;
  std::int32_t sent_margin = 0;

  // Scratch of Write, kept for its memory.
  std::vector<Candidate> candidates, sorted;
  std::vector<std::pair<float, std::uint32_t>> order;  // negative score, index of the candidate
  std::vector<DirtyRef> unsorted_dirty;
  std::vector<std::uint32_t> looked_at;    // places in dirty_list
  std::vector<std::uint32_t> seen_before;  // cells
  std::vector<SlotIndex> considered;
  struct Chosen {
    BodyId id;
    std::uint32_t dirty = 0;
    RecordCache::Key key;
    RecordCache::Record pose, velocity;
    const Bytes* properties = nullptr;  // null: not sent
    int bits = 0;
    bool velocities = false, repeated = false;
  };
  std::vector<Chosen> chosen;
  DatagramWriter writer;
  std::vector<std::vector<std::uint32_t>> spare;  // for SentDatagram::bodies
};

}  // namespace tessera::replication
