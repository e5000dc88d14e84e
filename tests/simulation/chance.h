// Chance: all that is random in a simulation, from one seed, the same with every standard library.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>

namespace tessera::simulation {

class Chance {
 public:
  explicit Chance(std::uint64_t seed) : state_(seed) {}

  // SplitMix64 (Steele et al. 2014).
  std::uint64_t Next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  // 0 to n - 1; n > 0.
  std::uint64_t Below(std::uint64_t n) { return Next() % n; }
  // 0 to n.
  std::uint64_t UpTo(std::uint64_t n) { return n == 0 ? 0 : Next() % (n + 1); }
  double Unit() { return static_cast<double>(Next() >> 11) * 0x1p-53; }  // [0, 1)
  double Between(double low, double high) { return low + (high - low) * Unit(); }
  bool Happens(double share) { return share > 0 && Unit() < share; }
  // A stream of its own, so that what one part draws does not shift what another gets.
  Chance Fork() { return Chance(Next()); }

 private:
  std::uint64_t state_;
};

}  // namespace tessera::simulation
