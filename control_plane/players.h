// Players: those of one instance, by number. A value whose copies are cheap: they share all that is alike, so a step
// that changes one player of ten thousand copies one bucket, and what changed is seen without a look at the rest.
//
//   Players next = instance.players;
//   next.Change(7, [](records::StoredPlayer& known) { known.mutable_player()->set_left(true); });
//   for (const std::uint32_t bucket : next.BucketsUnlike(instance.players)) Store(bucket, next.bucket(bucket));
//
// Thread rule: as any value; copies may be read from several threads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "control_plane/control_records.pb.h"

namespace tessera::control {

class Players {
 public:
  static constexpr std::uint32_t kBuckets = 64;  // a player's is its number modulo this

  std::size_t size() const;
  std::size_t present() const;  // those who have not left

  // Null: there is none with this number. It lives until this value changes.
  const records::StoredPlayer* Find(std::uint32_t number) const;
  // The number of the player who is there, by the id of its ticket; 0: none. It takes a look at each bucket, not at
  // each player, for every join with a ticket asks.
  std::uint32_t FindId(std::string_view player_id) const;
  // All, ascending by number. They live until this value changes.
  std::vector<const records::StoredPlayer*> All() const;
  template <class Function>
  void ForEach(const Function& function) const {  // in no order
    for (const auto& bucket : buckets_) {
      if (bucket == nullptr) continue;
      for (const records::StoredPlayer& known : bucket->kept.players()) function(known);
    }
  }

  // By its number, which is not 0, in the place of whoever has it.
  void Put(records::StoredPlayer known);
  // `function` takes a records::StoredPlayer&, and leaves the number. Nothing happens if there is none.
  template <class Function>
  void Change(std::uint32_t number, const Function& function) {
    const records::StoredPlayer* known = Find(number);
    if (known == nullptr) return;
    records::StoredPlayer next = *known;
    function(next);
    Put(std::move(next));
  }
  void Erase(std::uint32_t number);

  // --- Buckets, in which they are stored.
  // Null: it is empty.
  const records::PlayerBucket* bucket(std::uint32_t index) const {
    return buckets_[index] == nullptr ? nullptr : &buckets_[index]->kept;
  }
  // INVALID_ARGUMENT: the index is none, or a number is 0, of another bucket, or not above the one before it.
  absl::Status SetBucket(std::uint32_t index, records::PlayerBucket bucket);
  // Those of which the two do not share what is in them.
  std::vector<std::uint32_t> BucketsUnlike(const Players& other) const;

  // The difference that orders make between `before` and these: players that are new or differ, but for who was seen,
  // and the numbers of those that are no more, both ascending. The players live until this value changes.
  struct Changes {
    std::vector<const records::StoredPlayer*> players;
    std::vector<std::uint32_t> forgotten;
    bool empty() const { return players.empty() && forgotten.empty(); }
  };
  Changes ChangesSince(const Players& before) const;

 private:
  struct Bucket {
    records::PlayerBucket kept;
    std::size_t present = 0;  // those that have not left
    // Hash of the id, and number, of each of those that have one; ascending.
    std::vector<std::pair<std::uint64_t, std::uint32_t>> by_id{};
  };

  records::PlayerBucket CopyOf(std::uint32_t index) const;
  void Keep(std::uint32_t index, records::PlayerBucket kept);

  std::array<std::shared_ptr<const Bucket>, kBuckets> buckets_;  // null: empty
};

}  // namespace tessera::control
