// Inside of SnapshotSender: what one client was told, and what it is to be told next. Not for others.
#pragma once

#include <algorithm>
#include <bit>
#include <deque>
#include <optional>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/flat_hash_map.h"
#include "core/replication/datagram_writer.h"
#include "core/replication/snapshot_history.h"

namespace tessera::replication {

// What the client has acknowledged of a body.
struct Answered {
  Stamp acked = 0;       // the newest record; 0: none
  Stamp properties = 0;  // the newest that told them; 0: none
  // From `acked` to the one acknowledged before, and from that; 0: none of use.
  std::uint8_t gap = 0, gap2 = 0;
  std::uint8_t unanswered = 0;  // records since the last acknowledgement
};

// A body that the client is told of: what is left of it while the client has its present state.
struct Known {
  static constexpr std::uint32_t kNowhere = 0xffffffff;

  BodyId id;
  Answered answered;
  Epoch epoch;
  SlotIndex slot = 0;
  std::uint32_t generation = 0;   // of the slot's body
  std::uint32_t busy = kNowhere;  // its place among the busy; there what was acknowledged goes on
  bool used = false;
};

// One of which there is something to tell, or in doubt.
// By the time that a client's turn comes again others have filled the caches with theirs. So those that are looked at
// each time are half a line each and stand together, apart from the many more that rest.
struct alignas(32) Busy {
  enum class Use : std::uint8_t {
    kFree,
    kSeen,
    kGone,  // from what the client sees
  };
  Answered answered;
  Stamp sent = 0;  // at which it was written last; 0: never
  SlotIndex slot = 0;
  std::uint32_t known = 0;
  std::uint32_t first_sequence = 0;  // acknowledgements of earlier datagrams are about another
  std::uint16_t priority = 0;        // in 1 / kPriorityUnit of what is due at the next snapshot
  bool repeated = false;             // of the present state
  Use use = Use::kFree;
};
static_assert(sizeof(Busy) == 32);

// Which of the busy are free: the lowest are taken first, so that those in use stay close together.
class FreePlaces {
 public:
  // False: all are in use.
  bool Take(std::uint32_t& place) {
    for (; first_ < words_.size(); ++first_) {
      if (words_[first_] == 0) continue;
      place = static_cast<std::uint32_t>(64 * first_) + static_cast<std::uint32_t>(std::countr_zero(words_[first_]));
      words_[first_] &= words_[first_] - 1;
      return true;
    }
    return false;
  }
  void Give(std::uint32_t place) {
    const std::size_t word = place / 64;
    if (word >= words_.size()) words_.resize(word + 1);
    words_[word] |= std::uint64_t{1} << place % 64;
    first_ = std::min(first_, word);
  }

 private:
  std::vector<std::uint64_t> words_;
  std::size_t first_ = 0;  // those before it are 0
};

// A body that the client must learn is not there any more.
struct Gone {
  DepartureRecord record;
  std::uint32_t first_sequence = 0;
  std::optional<Tick> sent;
};

struct SentDatagram {
  Tick tick;
  std::vector<std::uint32_t> told;  // of the busy
  std::vector<BodyId> departures;
};

// Where a client looks from.
struct Eye {
  Eye(const ClientView& view, const Settings& settings);
  // Of the radius of interest, squared; without one, of 100 m: only for the order.
  float Shares(const SlotFace& face) const {
    return placed ? LengthSquared(face.position - centre) * per_radius_squared : 0;
  }
  // With which of the snapshots what is there is told.
  std::uint32_t Period(float shares) const;

  BodyId own;
  Vec3f centre;
  float per_radius_squared;
  bool placed, limited;
};

struct SnapshotSender::Impl {
  using History = SnapshotHistory::Impl;

  explicit Impl(const Settings& settings_in) : settings(settings_in), writer(settings.max_datagram_bytes) {}

  WrittenSnapshot Write(History& history, const ClientView& view, std::uint32_t last_input, std::int32_t margin);
  absl::Status Acknowledge(std::uint32_t newest, std::uint64_t mask);
  void Prefetch() const;

  void MoveOrigin(std::uint64_t origin);

  // What is seen.
  void Follow(const History& history, const ClientView& view);
  void ConsiderNews(const History& history, std::span<const std::uint32_t> cells);
  void ConsiderMembers(const History& history, const std::vector<std::uint32_t>& cells);
  void Consider(const History& history, SlotIndex slot);
  void Appear(const History& history, SlotIndex slot);
  void Depart(const History& history, std::uint32_t index);
  void Activate(std::uint32_t index);
  void Rest(std::uint32_t place);
  void MergeActive();

  // What is told.
  struct Candidate {
    BodyId id;
    std::uint32_t busy;
    float shares;  // Eye::Shares
    RecordCache::Key key;
  };
  void FindCandidates(const History& history, const ClientView& view);
  bool Due(const History& history, const Eye& eye, BodyId id, Busy& body, float& shares) const;
  void SortByScore(BodyId own);
  void Choose(History& history, const ClientView& view, WrittenSnapshot& result);
  static RecordCache::Key KeyFor(const History& history, const Busy& body);
  std::vector<DepartureRecord> DueDepartures(const History& history);
  void Remember(std::span<WrittenDatagram> datagrams, Tick tick, WrittenSnapshot& result);
  void EarnBudget(const History& history, const ClientView& view);
  void ForgetOldest();

  std::uint64_t News(std::uint32_t newest, std::uint64_t mask);
  void AcknowledgeOne(std::uint32_t sequence);
  void AcknowledgeBody(std::uint32_t told, std::uint32_t sequence, Stamp tick);

  Settings settings;
  InterestWindow window;
  std::uint64_t pushes_seen = 0;
  std::vector<Known> known;
  std::vector<std::uint32_t> unused;  // of `known`
  absl::flat_hash_map<SlotIndex, std::uint32_t> by_slot;
  std::vector<Busy> busy;
  FreePlaces idle;  // of `busy`
  // Of `busy`, those used: ascending by id but for the newest, which stand at the end. Their slots stand here too, so
  // that both are asked for before either is looked at.
  struct Active {
    BodyId id;
    std::uint32_t busy;
    SlotIndex slot;
  };
  std::vector<Active> active;
  std::size_t sorted_active = 0;  // so many of them are in order
  absl::btree_map<BodyId, Gone> gone;

  std::deque<SentDatagram> sent;  // the last one has the sequence next_sequence - 1
  // The newest acknowledgement: what it said needs no second look.
  std::uint32_t heard_newest = 0;
  std::uint64_t heard_mask = 0;
  std::uint32_t next_sequence = 1;
  std::uint64_t origin = 0;        // of the stamps: the history's
  double round_trip_ticks = 6;     // smoothed
  std::uint64_t repeat_after = 0;  // ticks: what is said again before has not had the time to be answered
  double allowance_bytes = 0;
  // Of the datagram written last.
  std::optional<Tick> told_tick;
  std::uint32_t told_input = 0;
  std::int32_t told_margin = 0;

  // Room used again and again.
  std::vector<Candidate> candidates;
  std::vector<Active> fresh_active;
  std::vector<std::uint32_t> seen_before;  // cells
  std::vector<SlotIndex> fresh;
  struct Chosen {
    BodyId id;
    std::uint32_t busy;
    bool velocities;
    RecordCache::Key key;
    RecordCache::Record pose, velocity;
    const Bytes* properties;  // null: not told
  };
  std::vector<Chosen> chosen;
  DatagramWriter writer;
  std::vector<std::vector<std::uint32_t>> spare;
};

}  // namespace tessera::replication
