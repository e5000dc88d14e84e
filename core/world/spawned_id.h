// Ids of bodies that a game makes while the world runs. Such an id says what the body is, so it needs no definition
// beside it on the wire, in logs or in snapshots: which prefab of the scene, and which of the prefab's bodies.
//
//   BodyId ball = SpawnedBodyId({.prefab = 2, .maker = 7, .count = 1});
//
// The maker is the incarnation of the worker that made it, and counts what it makes: no other worker, and no later life
// of this one, gives the same id. Bodies of one assembly have the same id but for `member`, so they follow each other.
//
// Bits, from the highest: 1 that is set, 10 of the prefab, 18 of the maker, 30 of the count, 5 of the member.
#pragma once

#include <cstdint>
#include <optional>

#include "core/world/ids.h"

namespace tessera {

inline constexpr std::uint64_t kMaxPrefabs = 1024, kMaxPrefabBodies = 32;
inline constexpr std::uint64_t kMaxMaker = (std::uint64_t{1} << 18) - 1, kMaxMade = (std::uint64_t{1} << 30) - 1;

struct SpawnedId {
  std::uint32_t prefab = 0;  // place in the scene's list
  std::uint32_t maker = 0;
  std::uint32_t count = 0;
  std::uint32_t member = 0;  // place in the prefab's list
  friend bool operator==(const SpawnedId&, const SpawnedId&) = default;
};

constexpr bool IsSpawned(BodyId body) { return body.value() >> 63 != 0; }
constexpr BodyId SpawnedBodyId(const SpawnedId& id) {
  return BodyId(std::uint64_t{1} << 63 | std::uint64_t{id.prefab} << 53 | std::uint64_t{id.maker} << 35 |
                std::uint64_t{id.count} << 5 | id.member);
}
constexpr SpawnedId PartsOf(BodyId body) {
  const std::uint64_t bits = body.value();
  return {static_cast<std::uint32_t>(bits >> 53 & (kMaxPrefabs - 1)),
          static_cast<std::uint32_t>(bits >> 35 & kMaxMaker), static_cast<std::uint32_t>(bits >> 5 & kMaxMade),
          static_cast<std::uint32_t>(bits & (kMaxPrefabBodies - 1))};
}
constexpr BodyId WithMember(BodyId body, std::size_t member) {
  return BodyId((body.value() & ~(kMaxPrefabBodies - 1)) | member);
}

// A joint that a game makes between two bodies while the world runs: bit 62 is set, then 18 of the maker and 30 of a
// count. Those of scenes are lower, those of prefabs have the highest bit.
constexpr bool IsGameJoint(JointId joint) { return joint.value() >> 62 == 1; }

// Gives ids to what one worker makes. Thread rule: one thread at a time.
class SpawnedIds {
 public:
  explicit SpawnedIds(Incarnation maker) : maker_(maker) {}

  // The id of the first body of a new one; nothing when the worker has given all its ids, or is too late a life to have
  // any.
  std::optional<BodyId> Next(std::size_t prefab) {
    if (maker_.value() > kMaxMaker || made_ == kMaxMade) return std::nullopt;
    ++made_;
    return SpawnedBodyId({static_cast<std::uint32_t>(prefab), static_cast<std::uint32_t>(maker_.value()), made_, 0});
  }

  // The same for a joint.
  std::optional<JointId> NextJoint() {
    if (maker_.value() > kMaxMaker || joints_ == kMaxMade) return std::nullopt;
    return JointId(std::uint64_t{1} << 62 | maker_.value() << 30 | ++joints_);
  }

 private:
  const Incarnation maker_;
  std::uint32_t made_ = 0, joints_ = 0;
};

}  // namespace tessera
