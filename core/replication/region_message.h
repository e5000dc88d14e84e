// RegionMessage: what a region says to a client on the reliable channel, as plain values: tessera.v1.RegionControl
// without protobuf, so that a client library carries none.
//
// The fields mean what game.proto says. A reader takes what protobuf takes: fields that it does not know are passed
// over, those that are left out are 0. Regions write with protobuf.
//
// Thread rule: free functions and plain values.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/math.h"
#include "core/world/partition_map.h"
#include "core/world/player_limits.h"

namespace tessera::replication {

// As tessera.v1.RefusalReason.
enum class RefusalReason : std::uint32_t {
  kUnspecified = 0,
  kProtocol = 1,
  kBadCredential = 2,
  kWrongInstance = 3,
  kUnknownPlayer = 5,
  kFull = 6,
  kStopping = 7,
  kWrongRegion = 8,
  kReplaced = 9,
  kSessionEnded = 65,
};
// "UNKNOWN_PLAYER"; empty for one that this version does not know.
std::string NameOf(RefusalReason reason);

// The parts of a map as they came, unchecked.
struct AnnouncedMap {
  MapVersion version;
  Rect bounds;
  std::vector<tessera::Cell> cells{};
  std::vector<MapRegion> regions{};
  WorldTerms terms{};
  // INVALID_ARGUMENT: what PartitionMap::Create and CheckTerms refuse, and version 0.
  absl::StatusOr<PartitionMap> Make() const;
};
struct AnnouncedEndpoint {
  std::uint32_t region = 0, game_port = 0;
  std::string host{};
  std::uint64_t incarnation = 0;
};

struct MapNews {
  AnnouncedMap map{};
  std::vector<AnnouncedEndpoint> endpoints{};
};
struct ClockNews {
  bool paused = false;
  double ticks_per_second = 0;
  std::uint64_t tick = 0;
};
struct Welcome {
  std::uint32_t region = 0, player = 0;
  bool started = false;
  MapNews news{};
  std::optional<ClockNews> clock{};
};
struct RegionRefusal {
  RefusalReason reason = RefusalReason::kUnspecified;
  std::string detail{};
};
struct Started {
  std::uint64_t tick = 0;
};
struct InputRefusal {
  std::uint64_t body = 0;
  std::uint32_t input_number = 0;
  std::string detail{};
};
struct Stopping {
  std::string reason{};
  bool goes_on = false;  // the world, without this process
};
struct PairMeeting {
  Vec3d point, normal;
  double impulse = 0;
};
struct PairChange {
  std::uint64_t body_a = 0, body_b = 0;
  bool trigger = false, begin = false;
  std::optional<PairMeeting> contact{};
};
struct PairNews {
  std::uint64_t tick = 0;
  std::vector<PairChange> events{};
  bool whole = false;
};
struct EventOfGame {
  std::string name{};
  std::vector<std::uint8_t> values{};
};
struct NewsOfPlayer {
  std::uint32_t last_command = 0, last_event = 0, epoch = 0;
  std::vector<EventOfGame> events{};
  bool spectating = false;
  Vec3d view;
  std::uint64_t controlled_body = 0;
  PlayerLimits limits{};               // as they came: WrongField judges them
  std::vector<std::uint8_t> joints{};  // as they came: game::DecodeJoints reads them
};
struct NewsOfWorld {
  std::uint32_t epoch = 0;
  std::uint64_t tick = 0;
  std::vector<std::uint8_t> properties{};
};
struct EndOfSession {
  std::string reason{};
};
struct CommandRefusal {
  std::uint32_t number = 0;
  std::string detail{};
  bool for_good = false;
};

using RegionMessage = std::variant<Welcome, RegionRefusal, Started, MapNews, InputRefusal, Stopping, PairNews,
                                   NewsOfPlayer, EndOfSession, CommandRefusal, ClockNews, NewsOfWorld>;

// INVALID_ARGUMENT: it is no RegionControl, or one of a kind that this version does not know.
absl::StatusOr<RegionMessage> DecodeRegionMessage(std::span<const std::uint8_t> bytes);

}  // namespace tessera::replication
