#include "bench/soak_turns.h"

#include <array>
#include <random>

namespace tessera::bench {
namespace {

using Kind = SoakTurnKind;

constexpr std::size_t kSoakKinds = static_cast<std::size_t>(kLastSoakTurn) + 1;
constexpr std::array<const char*, kSoakKinds> kSoakTurnNames = {"players",    "scale",      "death",
                                                                "checkpoint", "properties", "spawns"};
constexpr std::uint64_t kTurnsARound = 4;

}  // namespace

const char* NameOf(SoakTurnKind kind) { return kSoakTurnNames.at(static_cast<std::size_t>(kind)); }

std::vector<SoakTurn> DrawSoakTurns(std::uint64_t seed, std::size_t count) {
  std::mt19937_64 random(seed);  // without distributions, of which each library has its own
  std::vector<SoakTurn> turns;
  std::vector<Kind> left;
  std::uint64_t players_at = 0;
  while (turns.size() < count) {
    const std::uint64_t place = turns.size() % kTurnsARound;
    if (place == 0) players_at = random() % kTurnsARound;
    if (place == players_at) {
      turns.push_back({Kind::kPlayers, random()});
      continue;
    }
    if (left.empty()) {
      for (std::size_t i = 0; i < kSoakKinds; ++i) {
        if (static_cast<Kind>(i) != Kind::kPlayers) left.push_back(static_cast<Kind>(i));
      }
    }
    const auto at = left.begin() + static_cast<std::ptrdiff_t>(random() % left.size());
    turns.push_back({*at, random()});
    left.erase(at);
  }
  return turns;
}

}  // namespace tessera::bench
