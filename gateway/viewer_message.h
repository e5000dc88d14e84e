// ViewerMessage: what a viewer asks for, checked. docs/viewer_protocol.md lists the messages.
//
// Nothing in them is trusted: every field has a type and a range, and an error names the field. Thread rule: free
// functions on values; MessageBudget one thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "absl/status/statusor.h"
#include "client_sdk/client.h"
#include "core/world/ids.h"
#include "core/world/math.h"

namespace tessera::gateway {

struct SetView {
  std::optional<std::uint32_t> rate_hz{};  // nothing: as it was
  std::optional<Vec3d> center{};           // nothing: as it was
  double radius_m = 0;                     // 0: everything
  std::optional<double> bytes_per_s{};     // nothing: as it was
};
struct Select {
  BodyId body{};  // 0: none
};
// The property whose values of all bodies are sent.
struct ShowProperty {
  std::string name;  // empty: none
};
struct JoinWorld {
  std::string name;
  std::string ticket{};  // from a game's backend (docs/tickets.md), which says the name; empty: a guest
};
struct LeaveWorld {};
struct Steer {
  client::Steering steering;
};

enum class OrderKind : std::uint8_t {
  kScale,
  kCheckpoint,
  kRestore,
  kPause,
  kResume,
  kPace,
  kStep,
  kDrain,
  kSetProperty,
  kEndWorker,
  kRecord,
};
// "scale"
std::string_view NameOf(OrderKind kind);

struct Order {
  std::uint64_t number = 0;
  OrderKind kind = OrderKind::kPause;
  std::uint32_t regions = 0, region = 0, ticks = 0;
  std::uint64_t tick = 0;
  double ticks_per_second = 0;
  std::string host{}, property{};
  BodyId body{};
  nlohmann::json value{};  // for the property
  bool on = false;
};

// Orders of a viewer that plays a recording; a field that is left out stays.
struct PlayControl {
  std::optional<bool> paused{};
  std::optional<double> speed{}, at_s{};
  std::optional<int> step{};  // ticks, back if negative
};

// The right by which this viewer's orders are given from now on: one of the two.
struct Authorize {
  std::uint64_t number = 0;
  std::string token{}, key{};
};

using ViewerMessage =
    std::variant<SetView, Select, JoinWorld, LeaveWorld, Steer, Order, PlayControl, Authorize, ShowProperty>;

// The body that a JSON text of decimal digits names. Nothing: it is no text, has another character or no digit, or is
// beyond 2^64 - 1.
std::optional<BodyId> BodyIdFrom(const nlohmann::json& text);

// Errors: INVALID_ARGUMENT "rate_hz: must be a whole number from 1 to 60".
absl::StatusOr<ViewerMessage> ParseViewerMessage(std::string_view text);

// How many messages a viewer may send, and how many that are bad.
class MessageBudget {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  // One message came; false: it is one too many.
  bool Take(TimePoint now);
  // One message was bad, or too many; true: it is the last that is borne.
  bool Strike(TimePoint now);

 private:
  std::optional<TimePoint> last_;
  double tokens_ = 0;
  std::deque<TimePoint> strikes_;
};

}  // namespace tessera::gateway
