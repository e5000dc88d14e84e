// The C interface: joining, polling, the world, moving.

#include "absl/strings/str_cat.h"
#include "client_sdk/c_api/handle.h"
#include "client_sdk/session.h"

using namespace tessera;
using namespace tessera::c_api;
using client::ClientEvent;

namespace tessera::c_api {
namespace {

thread_local std::string last_error;

static_assert(TESSERA_EVENT_APPEARED == static_cast<int>(ClientEvent::Kind::kAppeared));
static_assert(TESSERA_EVENT_VANISHED == static_cast<int>(ClientEvent::Kind::kVanished));
static_assert(TESSERA_EVENT_STARTED == static_cast<int>(ClientEvent::Kind::kStarted));
static_assert(TESSERA_EVENT_INPUT_REFUSED == static_cast<int>(ClientEvent::Kind::kInputRefused));
static_assert(TESSERA_EVENT_REGION_LOST == static_cast<int>(ClientEvent::Kind::kRegionLost));
static_assert(TESSERA_EVENT_REGION_BACK == static_cast<int>(ClientEvent::Kind::kRegionBack));
static_assert(TESSERA_EVENT_MAP_CHANGED == static_cast<int>(ClientEvent::Kind::kMapChanged));
static_assert(TESSERA_EVENT_ENDED == static_cast<int>(ClientEvent::Kind::kEnded));
static_assert(TESSERA_EVENT_CONTACT_BEGAN == static_cast<int>(ClientEvent::Kind::kContactBegan));
static_assert(TESSERA_EVENT_CONTACT_ENDED == static_cast<int>(ClientEvent::Kind::kContactEnded));
static_assert(TESSERA_EVENT_TRIGGER_ENTERED == static_cast<int>(ClientEvent::Kind::kTriggerEntered));
static_assert(TESSERA_EVENT_TRIGGER_LEFT == static_cast<int>(ClientEvent::Kind::kTriggerLeft));
static_assert(TESSERA_EVENT_RECORDING_ENDED == static_cast<int>(ClientEvent::Kind::kRecordingEnded));
static_assert(TESSERA_EVENT_PROPERTY_CHANGED == static_cast<int>(ClientEvent::Kind::kPropertyChanged));
static_assert(TESSERA_EVENT_CLOCK_CHANGED == static_cast<int>(ClientEvent::Kind::kClockChanged));
static_assert(TESSERA_JOINING == static_cast<int>(client::ClientState::kJoining));
static_assert(TESSERA_WAITING == static_cast<int>(client::ClientState::kWaiting));
static_assert(TESSERA_PLAYING == static_cast<int>(client::ClientState::kPlaying));
static_assert(TESSERA_ENDED == static_cast<int>(client::ClientState::kEnded));

static_assert(TESSERA_MAX_TOKEN >= client::kMaxReturnTokenBytes);

tessera_body BodyFrom(const client::SeenBody& seen, const Pose& pose, BodyId own) {
  tessera_body body = TESSERA_BODY;
  body.id = seen.id.value();
  body.region = seen.region.value();
  const Vec3d& p = pose.position;
  const Quatd& q = pose.orientation;
  const Vec3f& v = seen.state.linear_velocity;
  const Vec3f& w = seen.state.angular_velocity;
  std::copy_n(std::begin({p.x, p.y, p.z}), 3, body.position);
  std::copy_n(std::begin({q.x, q.y, q.z, q.w}), 4, body.orientation);
  std::copy_n(std::begin({v.x, v.y, v.z}), 3, body.linear_velocity);
  std::copy_n(std::begin({w.x, w.y, w.z}), 3, body.angular_velocity);
  if (seen.state.asleep) body.flags |= TESSERA_BODY_ASLEEP;
  if (seen.id == own) body.flags |= TESSERA_BODY_OWN;
  return body;
}

// One with a path, or that is predicted alone, is no region's.
client::SeenBody OfNobody(const client::ShownBody& shown) {
  client::SeenBody body{};
  body.id = shown.id;
  body.state.linear_velocity = shown.velocity_m_s;
  body.state.angular_velocity = shown.spin_rad_s;
  return body;
}

Vec3f VectorFrom(const float* xyz) { return xyz == nullptr ? Vec3f() : Vec3f(xyz[0], xyz[1], xyz[2]); }

}  // namespace

tessera_code Report(const absl::Status& status) {
  if (status.ok()) return TESSERA_OK;
  last_error = std::string(status.message());
  return static_cast<tessera_code>(status.code());
}

tessera_code ReportAs(tessera_code code, const std::string& line) {
  last_error = line;
  return code;
}

tessera_code Refuse(const char* what) { return Report(absl::InvalidArgumentError(what)); }

void RefuseSize(const char* argument, std::size_t has, std::size_t least) {
  Report(absl::InvalidArgumentError(
      absl::StrCat(argument, ": has ", has, " bytes, at least ", least, "; the TESSERA_... initialisers set it")));
}

}  // namespace tessera::c_api

uint32_t tessera_version(void) { return TESSERA_VERSION_MAJOR * 1000 + TESSERA_VERSION_MINOR; }

const char* tessera_last_error(void) { return last_error.c_str(); }

tessera_code tessera_set_last_error(tessera_code code, const char* line) {
  return ReportAs(code, line == nullptr ? "" : line);
}

int64_t tessera_now(void) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(client::Clock::now().time_since_epoch()).count();
}

size_t tessera_return_token(const tessera_client* handle, uint8_t* token, size_t capacity) {
  if (handle == nullptr) return 0;
  return GuardedValue(size_t{0}, [&] {
    const std::vector<std::uint8_t> own = handle->client->return_token();
    if (token != nullptr && own.size() <= capacity) std::copy(own.begin(), own.end(), token);
    return own.size();
  });
}

tessera_code tessera_leave(tessera_client* handle, uint32_t deadline_ms) {
  if (handle == nullptr) return Refuse("client: is NULL");
  return Guarded([&] { return Report(handle->client->Leave(std::chrono::milliseconds(deadline_ms))); });
}

void tessera_close(tessera_client* handle) { delete handle; }

tessera_code tessera_poll(tessera_client* handle, int64_t now_ns) {
  if (handle == nullptr) return Refuse("client: is NULL");
  return Guarded([&] {
    for (ClientEvent& event : handle->client->Poll(At(now_ns))) handle->events.push_back(std::move(event));
    const absl::Status reason = handle->client->reason();
    if (!handle->client->needs_new_grant()) return Report(reason);
    return ReportAs(TESSERA_NEW_GRANT_NEEDED, std::string(reason.message()));
  });
}

tessera_state tessera_get_state(const tessera_client* handle) {
  return handle == nullptr ? tessera_state{TESSERA_ENDED} : static_cast<tessera_state>(handle->client->state());
}

int32_t tessera_next_event(tessera_client* handle, tessera_event* out) {
  if (handle == nullptr || out == nullptr || !IsSize<tessera_event>(out->size, "event.size")) return 0;
  if (handle->events.empty()) return 0;
  ClientEvent event = std::move(handle->events.front());
  handle->events.pop_front();
  handle->detail = std::move(event.detail);
  handle->property = std::move(event.property);
  tessera_event given = TESSERA_EVENT;
  given.kind = static_cast<tessera_event_kind>(event.kind);
  given.body = event.body.value();
  given.region = event.region.value();
  given.other = event.other.value();
  given.input = event.input_number;
  given.detail = handle->detail.c_str();
  given.property = handle->property.c_str();
  given.tile = event.tile;
  if (event.since_before) given.flags |= TESSERA_EVENT_SINCE_BEFORE;
  if (event.contact) {
    const client::MeetingPoint& met = *event.contact;
    given.contact_point[0] = met.point.x, given.contact_point[1] = met.point.y, given.contact_point[2] = met.point.z;
    given.contact_normal[0] = met.normal.x, given.contact_normal[1] = met.normal.y,
    given.contact_normal[2] = met.normal.z;
    given.contact_impulse = met.impulse;
  }
  GiveOut(given, out);
  return 1;
}

size_t tessera_bodies(tessera_client* handle, int64_t now_ns, tessera_body* bodies, size_t stride, size_t capacity) {
  if (handle == nullptr || (capacity > 0 && bodies == nullptr)) return 0;
  if (capacity > 0 && !IsSize<tessera_body>(stride, "stride")) return 0;
  return GuardedValue(size_t{0}, [&] {
    client::Client& client = *handle->client;
    const std::vector<client::ShownBody> shown = client.Interpolated(At(now_ns));
    const BodyId own = client.own_body();
    auto* at = reinterpret_cast<char*>(bodies);
    for (size_t i = 0; i < std::min(shown.size(), capacity); ++i, at += stride) {
      const client::SeenBody* seen = shown[i].seen;
      tessera_body body =
          seen != nullptr ? BodyFrom(*seen, shown[i].pose, own) : BodyFrom(OfNobody(shown[i]), shown[i].pose, own);
      if (shown[i].extrapolated) body.flags |= TESSERA_BODY_EXTRAPOLATED;
      if (shown[i].predicted) body.flags |= TESSERA_BODY_PREDICTED;
      body.size = static_cast<uint32_t>(stride);
      std::memcpy(at, &body, std::min(stride, sizeof body));
    }
    return shown.size();
  });
}

tessera_code tessera_find_body(const tessera_client* handle, uint64_t id, tessera_body* out) {
  if (handle == nullptr || out == nullptr) return Refuse("client or body: is NULL");
  if (!IsSize<tessera_body>(out->size, "body.size")) return TESSERA_INVALID_ARGUMENT;
  const auto found = handle->client->World().find(BodyId(id));
  if (found == handle->client->World().end()) return Report(absl::NotFoundError("body: not in sight"));
  const client::SeenBody& seen = found->second;
  GiveOut(BodyFrom(seen, {seen.state.position, seen.state.orientation}, handle->client->own_body()), out);
  return TESSERA_OK;
}

uint32_t tessera_player(const tessera_client* handle) {
  return handle == nullptr ? 0 : handle->client->player().value();
}
uint64_t tessera_own_body(const tessera_client* handle) {
  return handle == nullptr ? 0 : handle->client->own_body().value();
}
uint64_t tessera_player_body(uint32_t player) { return player == 0 ? 0 : PlayerBodyId(PlayerNumber(player)).value(); }
uint32_t tessera_player_of_body(uint64_t body) {
  return IsPlayerBody(BodyId(body)) ? PlayerOf(BodyId(body)).value() : 0;
}
uint64_t tessera_tick(const tessera_client* handle) { return handle == nullptr ? 0 : handle->client->tick().value(); }
uint64_t tessera_map_version(const tessera_client* handle) {
  return handle == nullptr ? 0 : handle->client->map().version().value();
}

tessera_code tessera_get_clock(const tessera_client* handle, tessera_clock* out) {
  if (handle == nullptr || out == nullptr) return Refuse("client or clock: is NULL");
  if (!IsSize<tessera_clock>(out->size, "clock.size")) return TESSERA_INVALID_ARGUMENT;
  const client::WorldClock from = handle->client->clock();
  tessera_clock clock = TESSERA_CLOCK;
  clock.paused = from.paused ? 1 : 0;
  clock.ticks_per_second = from.ticks_per_second;
  GiveOut(clock, out);
  return TESSERA_OK;
}

uint32_t tessera_move(tessera_client* handle, const float force[3], const float torque[3]) {
  return handle == nullptr ? 0 : handle->client->Move(VectorFrom(force), VectorFrom(torque));
}
uint32_t tessera_steer(tessera_client* handle, const tessera_steering* given) {
  if (handle == nullptr || given == nullptr) {
    Refuse("client or steering: is NULL");
    return 0;
  }
  if (!IsSize<tessera_steering>(given->size, "steering.size")) return 0;
  const tessera_steering from = TakeIn(given, tessera_steering TESSERA_STEERING);
  return handle->client->Steer({.force_n = VectorFrom(from.force),
                                .torque_nm = VectorFrom(from.torque),
                                .move = {from.move[0], from.move[1]},
                                .yaw_rad = from.yaw,
                                .pitch_rad = from.pitch,
                                .buttons = from.buttons});
}
tessera_code tessera_set_movement(tessera_client* handle, const struct tessera_movement* movement) {
  if (handle == nullptr) return Refuse("client: is NULL");
  return Guarded([&] { return Report(handle->client->SetMovement(movement)); });
}
uint32_t tessera_last_applied_input(const tessera_client* handle) {
  return handle == nullptr ? 0 : handle->client->last_applied_input();
}
