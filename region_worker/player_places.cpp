#include "region_worker/player_places.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/region/wire.h"
#include "core/world/limits.h"
#include "region_worker/link_message.h"

namespace tessera::worker {
namespace {

// Messages a second, at most.
constexpr std::uint64_t kRate_hz = 10;
// After how long a body that stands is told of again, and for how long a word counts: some may be lost with a link.
constexpr std::uint64_t kRepeat_s = 1, kLifetime_s = 4;
// Regions are a few ticks apart; over a closed border some seconds.
constexpr std::uint64_t kAhead_s = 60;
// Of as many as may play at one time, and of those who have just left. Their numbers only grow.
constexpr std::size_t kMaxKnown = 2 * kMaxPlayers;
// Player, epoch and tick, a byte each, and three floats.
constexpr std::size_t kMinWordBytes = 3 + 12;

bool IsSane(double c) { return std::isfinite(c) && std::abs(c) <= kMaxStatePosition_m; }

}  // namespace

void PlayerPlaces::Follow(Tick tick, std::span<const region::OwnedBody> owned) {
  // Players' bodies have the highest ids.
  for (auto body = owned.rbegin(); body != owned.rend() && IsPlayerBody(body->def->id); ++body) {
    known_[PlayerOf(body->def->id)].word = {body->epoch, tick, body->state.position};
  }
}

bool PlayerPlaces::IsOld(const Word& word, Tick tick) const {
  return word.tick.value() + kLifetime_s * tick_rate_hz_ < tick.value();
}

bool PlayerPlaces::IsNews(const Known& known) const {
  const auto& [word, told] = known;
  if (!told.has_value()) return true;
  if (std::pair(word.epoch, word.tick) <= std::pair(told->epoch, told->tick)) return false;
  return word.epoch != told->epoch || LengthSquared(word.position - told->position) > kMoved_m * kMoved_m ||
         word.tick.value() >= told->tick.value() + kRepeat_s * tick_rate_hz_;
}

std::vector<std::uint8_t> PlayerPlaces::Tell(Tick tick) {
  if (tick.value() < told_at_.value() + std::max<std::uint64_t>(1, tick_rate_hz_ / kRate_hz)) return {};
  std::erase_if(known_, [&](const auto& entry) { return IsOld(entry.second.word, tick); });
  std::vector<std::pair<PlayerNumber, Word>> news;
  for (auto& [player, known] : known_) {
    if (!IsNews(known)) continue;
    news.emplace_back(player, known.word);
    known.told = known.word;
  }
  if (news.empty()) return {};
  told_at_ = tick;
  region::Writer writer;
  writer.U8(static_cast<std::uint8_t>(LinkMessageKind::kPlaces));
  writer.Varint(news.size());
  for (const auto& [player, word] : news) {
    writer.Varint(player.value());
    writer.Varint(word.epoch.value());
    writer.Varint(word.tick.value());
    writer.V(Vec3f(word.position));
  }
  return writer.Take();
}

absl::Status PlayerPlaces::Hear(std::span<const std::uint8_t> message, Tick tick) {
  region::Reader reader(message);
  std::vector<std::pair<PlayerNumber, Word>> words(reader.Count(kMinWordBytes));
  for (auto& [player, word] : words) {
    player = PlayerNumber(reader.Varint32());
    word.epoch = Epoch(reader.Varint32());
    word.tick = Tick(reader.Varint());
    word.position = Vec3d(reader.V3f());
    if (!reader.ok()) break;
    if (player == PlayerNumber()) return absl::InvalidArgumentError("places: player");
    if (!IsSane(word.position.x) || !IsSane(word.position.y) || !IsSane(word.position.z)) {
      return absl::InvalidArgumentError(absl::StrCat("places: player ", player.value(), ": position"));
    }
  }
  if (!reader.ok()) return absl::InvalidArgumentError("places: truncated");
  if (reader.remaining() != 0) return absl::InvalidArgumentError("places: bytes left over");
  for (const auto& [player, word] : words) {
    if (IsOld(word, tick) || word.tick.value() > tick.value() + kAhead_s * tick_rate_hz_) continue;
    if (known_.size() >= kMaxKnown && !known_.contains(player)) continue;
    const auto [found, is_new] = known_.try_emplace(player, Known{word, std::nullopt});
    Word& known = found->second.word;
    if (std::pair(word.epoch, word.tick) > std::pair(known.epoch, known.tick)) known = word;
  }
  return absl::OkStatus();
}

std::optional<Vec3d> PlayerPlaces::At(PlayerNumber player, Tick tick) const {
  const auto found = known_.find(player);
  if (found == known_.end() || IsOld(found->second.word, tick)) return std::nullopt;
  return found->second.word.position;
}

}  // namespace tessera::worker
