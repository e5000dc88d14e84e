// LifeFence: keeps out orders of a control plane that was deposed and does not know it yet.
//
// The upper half of each revision is the number of the control plane's life on the cluster's store, which every leader
// raises before it orders anything. So once a life was seen, an earlier one is over: the agent stores the newest with
// its identity, so that one which is started anew has not forgotten. Only for clusters with several control planes: one
// alone cannot be deposed, and a store that was put back as a file begins with an earlier life.
// Thread rule: none of its own.
#pragma once

#include <cstdint>

namespace tessera::agent {

class LifeFence {
 public:
  // `newest`: the newest life that this host has seen; 0: none.
  explicit LifeFence(std::uint64_t newest = 0) : newest_(newest) {}

  // False: the order with this revision is of an earlier life than another that was let in.
  bool Admit(std::uint64_t revision) {
    const std::uint64_t life = revision >> kLifeShift;
    if (life < newest_) return false;
    newest_ = life;
    return true;
  }
  std::uint64_t newest() const { return newest_; }

 private:
  static constexpr int kLifeShift = 32;
  std::uint64_t newest_;
};

}  // namespace tessera::agent
