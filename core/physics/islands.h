// Islands: bodies that are awake and act on each other through contacts and joints. What is in different islands cannot
// feel the other's solving; an island sleeps as a whole.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace tessera::physics {

struct Island {
  bool solved = false;  // a contact that may touch, or a joint: else its bodies fly free
  bool sleepy = true;   // all its bodies have been still for long enough
  bool failed = false;  // its solving came out non-finite
  int batch = -1;       // which batch solves it
  int contacts = 0;     // manifolds
  int joints = 0;
  // What the last step and this one's contacts tell of how hard it is: see solve/substeps.h.
  float load_ratio = 0;     // largest impulse between two bodies, over what the lighter one weighs in a step
  float mass_ratio = 1;     // largest, of two that touch or are jointed
  float penetration_m = 0;  // deepest
  float joint_error_m = 0;  // widest gap
  float impact_m_s = 0;     // fastest approach
};

class Islands {
 public:
  void Reset(std::size_t bodies);
  void Unite(std::uint32_t a, std::uint32_t b);
  // After the last `Unite`: numbers the islands.
  void Number();
  Island& Of(std::uint32_t body) { return islands_[island_[body]]; }
  std::uint32_t IndexOf(std::uint32_t body) const { return island_[body]; }
  std::span<Island> all() { return islands_; }

 private:
  std::uint32_t Root(std::uint32_t node);

  std::vector<std::uint32_t> parent_, island_;
  std::vector<Island> islands_;
};

}  // namespace tessera::physics
