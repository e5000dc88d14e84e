#include "core/region/outgoing.h"

#include <algorithm>
#include <cassert>
#include <iterator>

namespace tessera::region {

void OutgoingMessages::SetNeighbors(std::span<const RegionId> neighbors, bool anew) {
  std::map<RegionId, Messages> before = std::exchange(by_neighbor_, {});
  if (anew) before.clear();
  for (const RegionId neighbor : neighbors) by_neighbor_.emplace(neighbor, std::move(before[neighbor]));
}

void OutgoingMessages::Add(RegionId to, Grant grant) {
  if (const auto it = by_neighbor_.find(to); it != by_neighbor_.end()) it->second.grants.push_back(std::move(grant));
}

void OutgoingMessages::Add(RegionId to, const LateCorrection& late) {
  if (const auto it = by_neighbor_.find(to); it != by_neighbor_.end()) it->second.late_corrections.push_back(late);
}

void OutgoingMessages::Add(RegionId to, const PlayerInput& input) {
  if (const auto it = by_neighbor_.find(to); it != by_neighbor_.end()) it->second.inputs.push_back(input);
}

void OutgoingMessages::Add(RegionId to, MessagePacket packet) {
  if (const auto it = by_neighbor_.find(to); it != by_neighbor_.end()) it->second.packets.push_back(std::move(packet));
}

void OutgoingMessages::ReplaceGrants(RegionId to, std::vector<Grant> grants) {
  if (const auto it = by_neighbor_.find(to); it != by_neighbor_.end()) it->second.grants = std::move(grants);
}

void OutgoingMessages::MoveTo(RegionId to, BorderFrame& frame) {
  Messages& messages = by_neighbor_.at(to);
  frame.grants = std::exchange(messages.grants, {});
  frame.late_corrections = std::exchange(messages.late_corrections, {});
  frame.inputs = std::exchange(messages.inputs, {});
  const std::size_t packets = std::min(messages.packets.size(), kMaxPackets);
  const auto rest = messages.packets.begin() + static_cast<std::ptrdiff_t>(packets);
  frame.packets.assign(std::make_move_iterator(messages.packets.begin()), std::make_move_iterator(rest));
  messages.packets.erase(messages.packets.begin(), rest);
}

void OutgoingMessages::Validate([[maybe_unused]] std::span<const RegionId> neighbors) const {
  assert(std::ranges::equal(by_neighbor_, neighbors, {}, [](const auto& entry) { return entry.first; }));
  assert(std::ranges::all_of(by_neighbor_, [](const auto& entry) {
    return std::ranges::none_of(entry.second.grants, [](const Grant& grant) { return grant.bodies.empty(); });
  }));
}

}  // namespace tessera::region
