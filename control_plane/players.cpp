#include "control_plane/players.h"

#include <algorithm>
#include <numeric>

#include "absl/strings/str_cat.h"

namespace tessera::control {
namespace {

template <class List>
auto PlaceIn(List& players, std::uint32_t number) {
  return std::lower_bound(
      players.begin(), players.end(), number,
      [](const records::StoredPlayer& known, std::uint32_t wanted) { return known.player().number() < wanted; });
}

}  // namespace

std::size_t Players::size() const {
  std::size_t sum = 0;
  for (const auto& bucket : buckets_) sum += bucket == nullptr ? 0 : static_cast<std::size_t>(bucket->players_size());
  return sum;
}

std::size_t Players::present() const { return std::accumulate(present_.begin(), present_.end(), std::size_t{0}); }

const records::StoredPlayer* Players::Find(std::uint32_t number) const {
  const auto& bucket = buckets_[number % kBuckets];
  if (bucket == nullptr) return nullptr;
  const auto place = PlaceIn(bucket->players(), number);
  return place == bucket->players().end() || place->player().number() != number ? nullptr : &*place;
}

std::uint32_t Players::FindId(std::string_view player_id) const {
  std::uint32_t found = 0;
  if (player_id.empty()) return found;
  ForEach([&](const records::StoredPlayer& known) {
    if (!known.player().left() && known.player().player_id() == player_id) found = known.player().number();
  });
  return found;
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
    const auto& now = (buckets_[index] == nullptr ? kNobody : *buckets_[index]).players();
    const auto& then = (before.buckets_[index] == nullptr ? kNobody : *before.buckets_[index]).players();
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
  return buckets_[index] == nullptr ? records::PlayerBucket() : *buckets_[index];
}

void Players::Keep(std::uint32_t index, records::PlayerBucket bucket) {
  present_[index] = static_cast<std::uint32_t>(std::ranges::count_if(
      bucket.players(), [](const records::StoredPlayer& known) { return !known.player().left(); }));
  buckets_[index] =
      bucket.players().empty() ? nullptr : std::make_shared<const records::PlayerBucket>(std::move(bucket));
}

}  // namespace tessera::control
