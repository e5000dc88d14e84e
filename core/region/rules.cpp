#include "core/region/rules.h"

#include <bit>

namespace tessera::region {
namespace {

// FNV-1a, low byte first.
class Hash {
 public:
  void Add(std::uint64_t value) {
    for (int i = 0; i < 8; ++i, value >>= 8) hash_ = (hash_ ^ (value & 0xff)) * 0x100000001b3;
  }
  void Add(double value) { Add(std::bit_cast<std::uint64_t>(value)); }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325;
};

}  // namespace

std::uint64_t RulesOf(const RegionSettings& settings) {
  Hash hash;
  hash.Add(std::uint64_t{kEngineVersion});
  hash.Add(settings.aura_m);
  hash.Add(std::uint64_t{settings.lookahead_ticks});
  hash.Add(std::uint64_t{settings.promise_ticks});
  hash.Add(std::uint64_t{settings.ghost_depth});
  hash.Add(std::uint64_t{settings.whole_up_to});
  hash.Add(settings.hysteresis_m);
  hash.Add(std::uint64_t{settings.max_grants_per_tick});
  hash.Add(std::uint64_t{settings.shared_origin});
  return hash.value() != 0 ? hash.value() : 1;
}

}  // namespace tessera::region
