#include "control_plane/players.h"

#include <algorithm>
#include <functional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"

namespace tessera::control {
namespace {

template <class List>
auto PlaceIn(List& players, std::uint32_t number) {
  return std::lower_bound(
      players.begin(), players.end(), number,
      [](const records::StoredPlayer& known, std::uint32_t wanted) { return known.player().number() < wanted; });
}

std::uint64_t HashOfId(std::string_view player_id) { return std::hash<std::string_view>()(player_id); }

}  // namespace

std::size_t Players::size() const {
  std::size_t sum = 0;
  for (const auto& bucket : buckets_) {
    sum += bucket == nullptr ? 0 : static_cast<std::size_t>(bucket->kept.players_size());
  }
  return sum;
}

std::size_t Players::present() const {
  std::size_t sum = 0;
  for (const auto& bucket : buckets_) sum += bucket == nullptr ? 0 : bucket->present;
  return sum;
}

const records::StoredPlayer* Players::Find(std::uint32_t number) const {
  const auto& bucket = buckets_[number % kBuckets];
  if (bucket == nullptr) return nullptr;
  const auto place = PlaceIn(bucket->kept.players(), number);
  return place == bucket->kept.players().end() || place->player().number() != number ? nullptr : &*place;
}

std::uint32_t Players::FindId(std::string_view player_id) const {
  if (player_id.empty()) return 0;
  const std::uint64_t hash = HashOfId(player_id);
  for (const auto& bucket : buckets_) {
    if (bucket == nullptr) continue;
    auto at = std::lower_bound(bucket->by_id.begin(), bucket->by_id.end(), std::pair(hash, std::uint32_t{0}));
    for (; at != bucket->by_id.end() && at->first == hash; ++at) {
      if (Find(at->second)->player().player_id() == player_id) return at->second;
    }
  }
  return 0;
}

std::vector<const records::StoredPlayer*> Players::All() const {
  std::vector<const records::StoredPlayer*> all;
  all.reserve(size());
  ForEach([&](const records::StoredPlayer& known) { all.push_back(&known); });
  std::sort(all.begin(), all.end(), [](const records::StoredPlayer* one, const records::StoredPlayer* other) {
    return one->player().number() < other->player().number();
  });
  return all;
}

void Players::Put(records::StoredPlayer known) {
  const std::uint32_t number = known.player().number();
  records::PlayerBucket bucket = CopyOf(number % kBuckets);
  auto& players = *bucket.mutable_players();
  if (const auto place = PlaceIn(players, number); place != players.end() && place->player().number() == number) {
    *place = std::move(known);
  } else {
    const auto at = place - players.begin();
    *players.Add() = std::move(known);
    std::rotate(players.begin() + at, players.end() - 1, players.end());
  }
  Keep(number % kBuckets, std::move(bucket));
}

void Players::Erase(std::uint32_t number) {
  if (Find(number) == nullptr) return;
  records::PlayerBucket bucket = CopyOf(number % kBuckets);
  bucket.mutable_players()->erase(PlaceIn(*bucket.mutable_players(), number));
  Keep(number % kBuckets, std::move(bucket));
}

absl::Status Players::SetBucket(std::uint32_t index, records::PlayerBucket bucket) {
  if (index >= kBuckets) return absl::InvalidArgumentError(absl::StrCat("players: there is no bucket ", index));
  std::uint32_t before = 0;
  for (const records::StoredPlayer& known : bucket.players()) {
    const std::uint32_t number = known.player().number();
    if (number <= before || number % kBuckets != index) {
      return absl::InvalidArgumentError(absl::StrCat("players: ", number, " has no place in bucket ", index));
    }
    before = number;
  }
  Keep(index, std::move(bucket));
  return absl::OkStatus();
}

std::vector<std::uint32_t> Players::BucketsUnlike(const Players& other) const {
  std::vector<std::uint32_t> unlike;
  for (std::uint32_t index = 0; index < kBuckets; ++index) {
    if (buckets_[index] != other.buckets_[index]) unlike.push_back(index);
  }
  return unlike;
}

Players::Changes Players::ChangesSince(const Players& before) const {
  static const records::PlayerBucket kNobody;
  Changes changes;
  for (const std::uint32_t index : BucketsUnlike(before)) {
    const auto& now = (buckets_[index] == nullptr ? kNobody : buckets_[index]->kept).players();
    const auto& then = (before.buckets_[index] == nullptr ? kNobody : before.buckets_[index]->kept).players();
    auto old = then.begin();
    for (const records::StoredPlayer& known : now) {
      const std::uint32_t number = known.player().number();
      for (; old != then.end() && old->player().number() < number; ++old)
        changes.forgotten.push_back(old->player().number());
      const bool there = old != then.end() && old->player().number() == number;
      if (!there || old->player().SerializeAsString() != known.player().SerializeAsString()) {
        changes.players.push_back(&known);
      }
      if (there) ++old;
    }
    for (; old != then.end(); ++old) changes.forgotten.push_back(old->player().number());
  }
  std::ranges::sort(changes.players, {}, [](const records::StoredPlayer* known) { return known->player().number(); });
  std::ranges::sort(changes.forgotten);
  return changes;
}

records::PlayerBucket Players::CopyOf(std::uint32_t index) const {
  return buckets_[index] == nullptr ? records::PlayerBucket() : buckets_[index]->kept;
}

void Players::Keep(std::uint32_t index, records::PlayerBucket kept) {
  if (kept.players().empty()) {
    buckets_[index] = nullptr;
    return;
  }
  Bucket bucket{.kept = std::move(kept)};
  for (const records::StoredPlayer& known : bucket.kept.players()) {
    if (known.player().left()) continue;
    ++bucket.present;
    const std::string& id = known.player().player_id();
    if (!id.empty()) bucket.by_id.emplace_back(HashOfId(id), known.player().number());
  }
  std::ranges::sort(bucket.by_id);
  buckets_[index] = std::make_shared<const Bucket>(std::move(bucket));
}

}  // namespace tessera::control
