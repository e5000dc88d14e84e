#include "core/physics/solve/coloring.h"

#include <algorithm>
#include <bit>

namespace tessera::physics {

std::uint8_t Coloring::Take(std::uint32_t a, std::uint32_t b) {
  std::uint64_t taken = 0;
  if (a != kStatic) taken |= taken_[a];
  if (b != kStatic) taken |= taken_[b];
  const int color = std::countr_one(taken);
  if (color == kColors) return kLeftOver;
  const std::uint64_t bit = std::uint64_t{1} << color;
  if (a != kStatic) taken_[a] |= bit;
  if (b != kStatic) taken_[b] |= bit;
  used_ = std::max(used_, color + 1);
  return static_cast<std::uint8_t>(color);
}

void Coloring::Color(const SolveBatch& batch) {
  used_ = 0;
  taken_.assign(batch.bodies.size(), 0);
  joints_.clear();
  for (const JointConstraint& joint : batch.joints) joints_.push_back(Take(joint.a, joint.b));
  contacts_.clear();
  for (const ContactConstraint& contact : batch.contacts) contacts_.push_back(Take(contact.a, contact.b));
}

}  // namespace tessera::physics
