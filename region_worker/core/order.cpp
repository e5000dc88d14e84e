#include "region_worker/core/order.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/region/failover_io.h"
#include "core/world/byte_view.h"
#include "core/world/limits.h"
#include "core/world/partition_io.h"
#include "core/world/player_name.h"
#include "core/world/proto_math.h"

namespace tessera::worker {
namespace {

constexpr std::uint32_t kDefaultSnapshotRateHz = 30;

absl::Status CheckAddressee(const v1::WorkerOrder& message, const Identity& self) {
  if (message.instance_id() == self.instance_id && message.region() == self.region.value() &&
      message.incarnation() == self.incarnation.value()) {
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(absl::StrCat("order for instance ", message.instance_id(), " region ",
                                                    message.region(), " incarnation ", message.incarnation(),
                                                    ", not for this worker"));
}

absl::Status ReadPeers(const v1::WorkerOrder& message, Order& order) {
  for (int i = 0; i < message.peers_size(); ++i) {
    const v1::RegionAddress& peer = message.peers(i);
    if (peer.region() == 0 || peer.region() > kMaxRegions) {
      return absl::InvalidArgumentError(absl::StrCat("peers[", i, "].region: ", peer.region()));
    }
    if (peer.link_port() == 0 || peer.link_port() > 65535) {
      return absl::InvalidArgumentError(absl::StrCat("peers[", i, "].link_port: ", peer.link_port()));
    }
    if (peer.game_port() > 65535) {
      return absl::InvalidArgumentError(absl::StrCat("peers[", i, "].game_port: ", peer.game_port()));
    }
    order.peers.push_back({RegionId(peer.region()), Incarnation(peer.incarnation()), peer.host(),
                           static_cast<std::uint16_t>(peer.link_port()), static_cast<std::uint16_t>(peer.game_port())});
  }
  return absl::OkStatus();
}

absl::Status ReadRevoked(const v1::WorkerOrder& message, Order& order) {
  order.revoked.reserve(static_cast<std::size_t>(message.revoked_size()));
  for (int i = 0; i < message.revoked_size(); ++i) {
    const v1::DeadRegion& life = message.revoked(i);
    if (life.region() == 0 || life.region() > kMaxRegions) {
      return absl::InvalidArgumentError(absl::StrCat("revoked[", i, "].region: ", life.region()));
    }
    order.revoked.push_back({RegionId(life.region()), Incarnation(life.incarnation())});
  }
  return absl::OkStatus();
}

absl::Status ReadPlayers(const v1::WorkerOrder& message, Order& order) {
  order.players.reserve(static_cast<std::size_t>(message.players_size()));
  for (int i = 0; i < message.players_size(); ++i) {
    const v1::Player& player = message.players(i);
    if (player.number() == 0) return absl::InvalidArgumentError(absl::StrCat("players[", i, "].number: 0"));
    if (i > 0 && player.number() <= message.players(i - 1).number()) {
      return absl::InvalidArgumentError(absl::StrCat("players[", i, "].number: ", player.number(), " does not ascend"));
    }
    // The control plane has checked it; one that is stored from before it did so is no name.
    const std::string name = CheckPlayerName(player.name()).ok() ? player.name() : "";
    order.players.push_back({.number = PlayerNumber(player.number()),
                             .generation = net::Generation(player.generation()),
                             .spawn_region = RegionId(player.spawn_region()),
                             .left = player.left(),
                             .parked = player.parked(),
                             .name = name,
                             .ended_because = player.ended_because()});
    for (const v1::Property& property : player.properties()) {
      if (auto value = FromProto(property)) {
        order.players.back().properties.emplace_back(property.name(), *std::move(value));
      }
    }
  }
  return absl::OkStatus();
}

absl::Status ReadPlayerChanges(const v1::WorkerOrder& message, Order& order) {
  order.players_since = message.players_since();
  for (const std::uint32_t number : message.players_forgotten()) {
    if (!order.players_forgotten.empty() && number <= order.players_forgotten.back().value()) {
      return absl::InvalidArgumentError(absl::StrCat("players_forgotten: ", number, " does not ascend"));
    }
    order.players_forgotten.emplace_back(number);
  }
  return absl::OkStatus();
}

absl::Status InField(const char* field, const absl::Status& status) {
  return absl::InvalidArgumentError(absl::StrCat(field, ": ", status.message()));
}

// There is none until the control plane has heard of this worker's key.
absl::Status ReadCertificate(const v1::WorkerOrder& message, const Identity& self, Order& order) {
  if (message.certificate().empty()) return absl::OkStatus();
  const auto instance_key = net::VerificationKeyFrom(message.instance_key(), "instance_key");
  if (!instance_key.ok()) return instance_key.status();
  const std::span<const std::uint8_t> bytes = AsBytes(message.certificate());
  const auto certificate = net::ReadWorkerCertificate(bytes, self.instance_id, *instance_key);
  if (!certificate.ok()) return InField("certificate", certificate.status());
  if (certificate->region != self.region || certificate->incarnation != self.incarnation) {
    return absl::InvalidArgumentError("certificate: is another worker's");
  }
  order.certified = {
      .instance_key = *instance_key, .certificate = {bytes.begin(), bytes.end()}, .worker_key = certificate->key};
  return absl::OkStatus();
}

absl::Status ReadMaps(const v1::WorkerOrder& message, Order& order) {
  if (message.has_map()) {
    absl::StatusOr<PartitionMap> map = FromProto(message.map());
    if (!map.ok()) return InField("map", map.status());
    order.map = *std::move(map);
  }
  if (message.has_planned()) {
    absl::StatusOr<PartitionMap> map = FromProto(message.planned().map());
    if (!map.ok()) return InField("planned.map", map.status());
    if (message.planned().effective_tick() == 0) return absl::InvalidArgumentError("planned.effective_tick: 0");
    order.planned = {*std::move(map), Tick(message.planned().effective_tick()), message.planned().committed()};
  }
  return absl::OkStatus();
}

absl::Status ReadFailover(const v1::WorkerOrder& message, Order& order) {
  if (message.has_failover()) {
    if (!order.map || message.failover().version() != order.map->version().value()) {
      return absl::InvalidArgumentError("failover.version: not that of the map");
    }
    order.failover = {.version = order.map->version(), .dead = {}};
    for (const v1::DeadRegion& dead : message.failover().dead()) {
      order.failover->dead.push_back({RegionId(dead.region()), Incarnation(dead.incarnation())});
    }
  }
  if (message.has_resolution()) {
    absl::StatusOr<region::Resolution> resolution = region::FromProto(message.resolution());
    if (!resolution.ok()) return InField("resolution", resolution.status());
    order.resolution = *std::move(resolution);
  }
  return absl::OkStatus();
}

absl::Status ReadStandby(const v1::WorkerOrder& message, const Identity& self, Order& order) {
  const auto bad = [&](std::uint32_t region) { return region > kMaxRegions || RegionId(region) == self.region; };
  if (bad(message.standby())) return absl::InvalidArgumentError(absl::StrCat("standby: ", message.standby()));
  order.standby = RegionId(message.standby());
  for (int i = 0; i < message.primaries_size(); ++i) {
    if (message.primaries(i) == 0 || bad(message.primaries(i))) {
      return absl::InvalidArgumentError(absl::StrCat("primaries[", i, "]: ", message.primaries(i)));
    }
    order.primaries.push_back(RegionId(message.primaries(i)));
  }
  return absl::OkStatus();
}

void ReadStates(const v1::WorkerOrder& message, Order& order) {
  if (message.has_checkpoint()) {
    order.checkpoint = {.tick = Tick(message.checkpoint().tick()), .path = message.checkpoint().path(), .hash = {}};
  }
  if (message.has_initial_state()) {
    const v1::InitialState& state = message.initial_state();
    order.initial_state = {.tick = Tick(state.tick()), .path = state.path(), .hash = state.hash()};
  }
  order.joins_running = message.joins_running();
}

absl::Status ReadBorders(const v1::BorderSettings& message, region::RegionSettings& borders) {
  if (message.ghost_depth() > region::kMaxGhostDepth) {
    return absl::InvalidArgumentError(absl::StrCat("borders.ghost_depth: ", message.ghost_depth()));
  }
  if (message.whole_up_to() > region::kMaxWholeUpTo) {
    return absl::InvalidArgumentError(absl::StrCat("borders.whole_up_to: ", message.whole_up_to()));
  }
  if (message.has_ghost_depth()) borders.ghost_depth = message.ghost_depth();
  if (message.has_whole_up_to()) borders.whole_up_to = message.whole_up_to();
  return absl::OkStatus();
}

// The scene decides about names and types.
absl::Status ReadRecord(const v1::WorkerOrder& message, Order& order) {
  for (int i = 0; i < message.property_changes_size(); ++i) {
    const v1::PropertyChange& change = message.property_changes(i);
    const std::uint64_t last = order.properties.empty() ? 0 : order.properties.back().number;
    if (change.number() <= last) {
      return absl::InvalidArgumentError(absl::StrCat("property_changes[", i, "].number: ", change.number()));
    }
    std::optional<PropertyValue> value = FromProto(change.property());
    if (!value) return absl::InvalidArgumentError(absl::StrCat("property_changes[", i, "].property: has no value"));
    const BodyId body = change.body() == 0 ? kInstanceBody : BodyId(change.body());
    order.properties.push_back({change.number(), body, change.property().name(), *std::move(value)});
  }
  return absl::OkStatus();
}

absl::Status ReadBackend(const v1::WorkerOrder& message, BackendOrderList& backend) {
  backend.published_up_to = message.published_up_to();
  std::uint64_t last = 0;
  for (int i = 0; i < message.backend_messages_size(); ++i) {
    const v1::BackendMessage& sent = message.backend_messages(i);
    const auto fault = [i](const char* field, absl::string_view what) {
      return absl::InvalidArgumentError(absl::StrCat("backend_messages[", i, "]", field, ": ", what));
    };
    if (sent.number() <= last) return fault(".number", absl::StrCat(sent.number()));
    last = sent.number();
    BackendOrder order{sent.number(), sent.body() == 0 ? kInstanceBody : BodyId(sent.body()), {}};
    order.message.name = sent.name();
    order.message.values.assign(sent.values().begin(), sent.values().end());
    if (absl::Status status = game::CheckMessage(order.message); !status.ok()) return fault("", status.message());
    backend.messages.push_back(std::move(order));
  }
  return absl::OkStatus();
}

// It goes into the log as it is.
bool IsOperation(const std::string& text) {
  constexpr std::size_t kMostOperation = 32;
  const auto fits = [](unsigned char c) { return absl::ascii_isalnum(c) || c == '-'; };
  return text.size() <= kMostOperation && std::all_of(text.begin(), text.end(), fits);
}

}  // namespace

void CompletePlayers(std::vector<OrderedPlayer> before, Order& order) {
  for (OrderedPlayer& player : order.players) {
    const auto place = std::ranges::lower_bound(before, player.number, {}, &OrderedPlayer::number);
    if (place != before.end() && place->number == player.number) {
      *place = std::move(player);
    } else {
      before.insert(place, std::move(player));
    }
  }
  if (!order.players_forgotten.empty()) {
    std::erase_if(before, [&](const OrderedPlayer& player) {
      return std::ranges::binary_search(order.players_forgotten, player.number);
    });
  }
  order.players = std::move(before);
  order.players_forgotten.clear();
  order.players_since = 0;
}

const OrderedPlayer* FindPlayer(std::span<const OrderedPlayer> players, PlayerNumber number) {
  const auto place = std::ranges::lower_bound(players, number, {}, &OrderedPlayer::number);
  return place == players.end() || place->number != number ? nullptr : &*place;
}

absl::StatusOr<Order> CheckOrder(const v1::WorkerOrder& message, const Identity& self,
                                 const region::RegionSettings& borders) {
  if (absl::Status status = CheckAddressee(message, self); !status.ok()) return status;
  Order order;
  order.borders = borders;
  order.revision = message.revision();
  if (IsOperation(message.operation())) order.operation = message.operation();
  order.scene_path = message.scene_path();
  order.scene_hash = message.scene_hash();
  if (!message.game_hash().empty()) {
    order.game = {.path = message.game_path(),
                  .hash = message.game_hash(),
                  .name = message.game_name(),
                  .number = 0,
                  .failure = {},
                  .native = message.game_native()};
  }
  if (!message.movement_name().empty()) {
    order.movement = {.path = message.movement_path(),
                      .hash = message.movement_hash(),
                      .name = message.movement_name(),
                      .number = 0,
                      .failure = {},
                      .native = true};
  }
  if (message.has_next_game()) {
    const v1::NextGame& next = message.next_game();
    order.next_game = {.path = next.path(),
                       .hash = next.hash(),
                       .name = next.name(),
                       .number = next.number(),
                       .failure = next.failure()};
  }
  order.resumed = MapVersion(message.resumed_version());
  order.run = message.run();
  order.stop = message.stop();
  order.goes_on = message.goes_on();
  order.snapshot_rate_hz = message.snapshot_rate_hz() == 0 ? kDefaultSnapshotRateHz : message.snapshot_rate_hz();
  if (order.snapshot_rate_hz > kMaxTickRateHz) {
    return absl::InvalidArgumentError(absl::StrCat("snapshot_rate_hz: ", order.snapshot_rate_hz));
  }
  if (absl::Status status = ReadBorders(message.borders(), order.borders); !status.ok()) return status;
  if (message.region_threads() > region::kMaxRegionThreads) {
    return absl::InvalidArgumentError(absl::StrCat("region_threads: ", message.region_threads()));
  }
  if (message.region_threads() != 0) order.borders.threads = message.region_threads();
  if (absl::Status status = ReadCertificate(message, self, order); !status.ok()) return status;
  if (absl::Status status = ReadMaps(message, order); !status.ok()) return status;
  if (absl::Status status = ReadFailover(message, order); !status.ok()) return status;
  if (absl::Status status = ReadStandby(message, self, order); !status.ok()) return status;
  ReadStates(message, order);
  if (absl::Status status = ReadPeers(message, order); !status.ok()) return status;
  if (absl::Status status = ReadRevoked(message, order); !status.ok()) return status;
  if (absl::Status status = ReadPlayers(message, order); !status.ok()) return status;
  if (absl::Status status = ReadPlayerChanges(message, order); !status.ok()) return status;
  if (absl::Status status = ReadRecord(message, order); !status.ok()) return status;
  if (absl::Status status = ReadBackend(message, order.backend); !status.ok()) return status;
  return order;
}

}  // namespace tessera::worker
