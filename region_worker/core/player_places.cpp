#include "region_worker/core/player_places.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/world/bytes.h"
#include "core/world/limits.h"
#include "region_worker/core/link_message.h"

namespace tessera::worker {
namespace {

// At most so many messages a second.
constexpr std::uint64_t kRate_hz = 10;
// A body that stands is reported again after the first, since some reports are lost with a link; a report counts for
// the second.
constexpr std::uint64_t kRepeat_s = 1, kLifetime_s = 4;
// Regions are a few ticks apart; while a link is down, some seconds.
constexpr std::uint64_t kAhead_s = 60;
// As many as may play at one time, and those who have just left. Their numbers only grow.
constexpr std::size_t kMaxPlaces = 2 * kMaxPlayers;
// Player, epoch, tick and team, a byte each, and three floats.
constexpr std::size_t kMinPlaceBytes = 4 + 12;

bool IsSane(double c) { return std::isfinite(c) && std::abs(c) <= kMaxStatePosition_m; }

}  // namespace

void PlayerPlaces::Follow(const region::Region& region) {
  for (const region::OwnedBody& body : region::PlayersAmong(region.owned())) {
    const BodyId id = body.def->id;
    Report(PlayerOf(id), body.epoch, region.tick(), body.state.position, region.AudienceOf(id).team);
  }
}

void PlayerPlaces::Report(PlayerNumber player, Epoch epoch, Tick tick, Vec3d position, TeamId team) {
  players_[player].newest = {epoch, tick, position, team};
}

bool PlayerPlaces::IsOld(const PlayerPlace& place, Tick tick) const {
  return place.tick.value() + kLifetime_s * tick_rate_hz_ < tick.value();
}

bool PlayerPlaces::IsNews(const Player& player) const {
  const auto& [newest, sent] = player;
  if (!sent.has_value()) return true;
  if (std::pair(newest.epoch, newest.tick) <= std::pair(sent->epoch, sent->tick)) return false;
  return newest.epoch != sent->epoch || newest.team != sent->team ||
         LengthSquared(newest.position - sent->position) > kMoved_m * kMoved_m ||
         newest.tick.value() >= sent->tick.value() + kRepeat_s * tick_rate_hz_;
}

std::vector<std::uint8_t> PlayerPlaces::Write(Tick tick) {
  if (tick.value() < written_at_.value() + std::max<std::uint64_t>(1, tick_rate_hz_ / kRate_hz)) return {};
  std::erase_if(players_, [&](const auto& entry) { return IsOld(entry.second.newest, tick); });
  std::vector<std::pair<PlayerNumber, PlayerPlace>> news;
  for (auto& [number, player] : players_) {
    if (!IsNews(player)) continue;
    news.emplace_back(number, player.newest);
    player.sent = player.newest;
  }
  if (news.empty()) return {};
  written_at_ = tick;
  ByteWriter writer;
  writer.U8(static_cast<std::uint8_t>(LinkMessageKind::kPlaces));
  writer.Varint(news.size());
  for (const auto& [number, place] : news) {
    writer.Varint(number.value());
    writer.Varint(place.epoch.value());
    writer.Varint(place.tick.value());
    writer.V(Vec3f(place.position));
    writer.Varint(place.team);
  }
  return writer.Take();
}

absl::Status PlayerPlaces::Receive(std::span<const std::uint8_t> message, Tick tick) {
  ByteReader reader(message);
  reader.Field("places");
  std::vector<std::pair<PlayerNumber, PlayerPlace>> places(reader.Count(kMinPlaceBytes));
  for (auto& [number, place] : places) {
    number = PlayerNumber(reader.Varint32());
    place.epoch = Epoch(reader.Varint32());
    place.tick = Tick(reader.Varint());
    place.position = Vec3d(reader.V3f());
    place.team = reader.Varint();
    if (!reader.ok()) break;
    if (number == PlayerNumber()) return absl::InvalidArgumentError("places: player");
    if (!IsSane(place.position.x) || !IsSane(place.position.y) || !IsSane(place.position.z)) {
      return absl::InvalidArgumentError(absl::StrCat("places: player ", number.value(), ": position"));
    }
  }
  if (!reader.ok()) return absl::InvalidArgumentError(reader.error());
  if (reader.remaining() != 0) return absl::InvalidArgumentError("places: bytes left over");
  for (const auto& [number, place] : places) {
    if (IsOld(place, tick) || place.tick.value() > tick.value() + kAhead_s * tick_rate_hz_) continue;
    if (players_.size() >= kMaxPlaces && !players_.contains(number)) continue;
    const auto [found, is_new] = players_.try_emplace(number, Player{place, std::nullopt});
    PlayerPlace& newest = found->second.newest;
    if (std::pair(place.epoch, place.tick) > std::pair(newest.epoch, newest.tick)) newest = place;
  }
  return absl::OkStatus();
}

const PlayerPlace* PlayerPlaces::Find(PlayerNumber player, Tick tick) const {
  const auto found = players_.find(player);
  return found == players_.end() || IsOld(found->second.newest, tick) ? nullptr : &found->second.newest;
}

std::optional<Vec3d> PlayerPlaces::At(PlayerNumber player, Tick tick) const {
  const PlayerPlace* const place = Find(player, tick);
  return place == nullptr ? std::nullopt : std::optional(place->position);
}

TeamId PlayerPlaces::TeamAt(PlayerNumber player, Tick tick) const {
  const PlayerPlace* const place = Find(player, tick);
  return place == nullptr ? 0 : place->team;
}

}  // namespace tessera::worker
