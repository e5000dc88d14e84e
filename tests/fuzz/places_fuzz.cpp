// A neighbour's message at a link, and what it says of where players' bodies are. What is refused changes nothing; what
// is taken is sane, is passed on in full to the next region, and does not come round again.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "core/world/limits.h"
#include "region_worker/core/link_message.h"
#include "region_worker/core/player_places.h"

namespace {

using namespace tessera;
using namespace tessera::worker;

constexpr std::uint32_t kRate_hz = 60;
constexpr Tick kNow(1000), kLater(1000 + kRate_hz / 2);

// A region that owns the body of player 2 and has heard of nobody else.
PlayerPlaces MakePlaces() {
  PlayerPlaces places(kRate_hz);
  places.Report(PlayerNumber(2), Epoch(3), kNow, {1, 2, 3}, TeamId{4});
  return places;
}

std::vector<std::uint8_t> WrittenBy(PlayerPlaces places) { return places.Write(kNow); }

bool IsSane(double c) { return std::isfinite(c) && std::abs(c) <= kMaxStatePosition_m; }

void CheckPlaces(const PlayerPlaces& places) {
  for (std::uint32_t player = 0; player <= kMaxPlayers + 1; ++player) {
    const auto place = places.At(PlayerNumber(player), kNow);
    if (!place.has_value()) continue;
    if (player == 0) std::abort();
    if (!IsSane(place->x) || !IsSane(place->y) || !IsSane(place->z)) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto message = ReadLinkMessage(std::span(data, size));
  if (!message.has_value() || message->kind != LinkMessageKind::kPlaces) return 0;
  PlayerPlaces places = MakePlaces();
  const auto before = WrittenBy(places);
  const bool taken = places.Receive(message->bytes, kNow).ok();
  const auto told = WrittenBy(places);
  if (!taken && told != before) std::abort();
  CheckPlaces(places);
  if (places.Receive(message->bytes, kNow).ok() != taken || WrittenBy(places) != told) std::abort();

  PlayerPlaces next(kRate_hz);
  if (places.Write(kNow) != told || !next.Receive(std::span(told).subspan(1), kNow).ok()) std::abort();
  if (WrittenBy(next) != told) std::abort();
  if (!places.Receive(std::span(told).subspan(1), kNow).ok() || !places.Write(kLater).empty()) std::abort();
  return 0;
}
