#include "bench/snapshots_net.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <random>

#include "absl/strings/str_cat.h"
#include "bench/snapshots_trace.h"
#include "bench/statistics.h"
#include "client_sdk/playout_clock.h"
#include "client_sdk/world_view.h"
#include "core/physics/world.h"
#include "core/region/fields.h"
#include "core/replication/quantize.h"
#include "core/replication/snapshot.h"
#include "core/replication/testing/moving_bodies.h"
#include "core/world/scene_load.h"
#include "host/files.h"

namespace tessera::bench {
namespace {

using namespace replication;

constexpr double kOneWay_ms = 20, kJitter_ms = 50, kTick_ms = 1000.0 / 60;

// One direction: each datagram on its own way, late, lost, or after those before it where the line is thin.
class Way {
 public:
  Way(double loss, double jitter_ms, double bytes_per_s, unsigned seed)
      : loss_(loss), jitter_ms_(jitter_ms), bytes_per_s_(bytes_per_s), random_(seed) {}

  void Send(double now_ms, Bytes bytes) {
    free_at_ms_ = std::max(free_at_ms_, now_ms);
    if (bytes_per_s_ > 0)
      free_at_ms_ += (static_cast<double>(bytes.size()) + kDatagramOverheadBytes) / bytes_per_s_ * 1000;
    if (Uniform() < loss_) return;
    under_way_.emplace((bytes_per_s_ > 0 ? free_at_ms_ : now_ms) + kOneWay_ms + jitter_ms_ * Uniform(),
                       std::move(bytes));
  }
  template <class Take>
  void Deliver(double now_ms, const Take& take) {
    for (auto at = under_way_.begin(); at != under_way_.end() && at->first <= now_ms; at = under_way_.erase(at)) {
      take(at->second, at->first);
    }
  }

 private:
  double Uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  double loss_, jitter_ms_, bytes_per_s_;
  std::mt19937 random_;
  double free_at_ms_ = 0;
  std::multimap<double, Bytes> under_way_;
};

// --- The 901 cubes over loss -----------------------------------------------------------------------------------------

absl::Status LossRow(const CubeTrace& trace, double loss, Report& report) {
  SnapshotSettings settings = CubeSettings();
  settings.gravity_m_s2 = -20;
  settings.velocity_radius_m = 0;  // as the reference: poses alone
  const Quantizer quantizer(CubeBounds(), settings);
  SnapshotHistory history(CubeBounds(), settings);
  SnapshotSender sender(settings);
  SnapshotReceiver receiver(CubeBounds(), settings);
  Way down(loss, kJitter_ms, 0, 1), up(loss, kJitter_ms, 0, 2);
  std::vector<double> bytes, age_ms;
  std::size_t errors = 0;
  std::vector<BodyRecord> cubes;
  for (std::size_t i = 0; i < CubeTrace::kCubes; ++i) cubes.push_back({BodyId(i + 1), Epoch(1), {}});
  for (std::size_t t = 0; t < trace.ticks.size(); ++t) {
    const double now_ms = static_cast<double>(t) * kTick_ms;
    for (std::size_t i = 0; i < cubes.size(); ++i) cubes[i].state = quantizer.Dequantize(trace.ticks[t][i]);
    const Tick tick(t + 1);
    history.Push(tick, cubes, {});
    std::size_t sent = 0;
    for (Bytes& datagram : sender.Write(history, {.centre = cubes[0].state.position}, 0, 0).datagrams) {
      sent += datagram.size();
      down.Send(now_ms, std::move(datagram));
    }
    const bool settled = t >= 120;  // the whole world has been sent by then
    if (settled) bytes.push_back(static_cast<double>(sent));
    bool any = false;
    down.Deliver(now_ms, [&](const Bytes& datagram, double) {
      const auto got = receiver.Read(datagram);
      if (!got.ok()) {
        errors += absl::IsInvalidArgument(got.status()) ? 1 : 0;
        return;
      }
      any = true;
      if (settled) age_ms.push_back(static_cast<double>(tick - got->tick) * kTick_ms);
    });
    if (any) up.Send(now_ms, receiver.WriteAck());
    absl::Status status;
    up.Deliver(now_ms, [&](const Bytes& ack, double) {
      if (status.ok()) status = sender.Acknowledge(ack);
    });
    if (!status.ok()) return status;
  }
  if (errors > 0) return absl::InternalError(absl::StrCat("loss: ", errors, " datagrams could not be decoded"));
  const auto add = [&](const char* metric, double value, const char* unit) {
    report.Add("loss", "tessera", absl::StrCat(loss * 100, " % loss"), metric, value, unit);
  };
  const auto kbps = [](double b) { return b * 8 * 60 / 1000; };
  double sum = 0;
  for (const double b : bytes) sum += b;
  add("kbps_mean", kbps(sum / static_cast<double>(bytes.size())), "kbit/s");
  add("kbps_p95", kbps(Quantile(bytes, 0.95)), "kbit/s");
  add("kbps_max", kbps(Quantile(bytes, 1)), "kbit/s");
  add("age_ms_p95", Quantile(age_ms, 0.95), "ms");
  add("decode_errors", static_cast<double>(errors), "1");
  return absl::OkStatus();
}

// --- The plaza, shown ------------------------------------------------------------------------------------------------

absl::StatusOr<std::shared_ptr<const Scene>> LoadPlaza(std::uint32_t bodies) {
  constexpr char kFile[] = "scenes/plaza.textproto";
  const absl::StatusOr<std::string> text = host::ReadFile(kFile, std::size_t{1} << 20);
  if (!text.ok()) return absl::NotFoundError(absl::StrCat(text.status().message(), "; run it from the repository"));
  absl::StatusOr<LoadedScene> loaded = LoadScene(SceneForm::kText, *text, kFile, {.scatter_count = bodies, .hash = {}});
  if (!loaded.ok()) return loaded.status();
  return loaded->scene;
}

// The world's true states of the last ticks.
class Truth {
 public:
  void Push(std::span<const BodyRecord> bodies) {
    std::map<BodyId, BodyState>& states = ticks_.emplace_back();
    for (const BodyRecord& body : bodies) states.emplace(body.id, body.state);
    ++newest_;
    if (ticks_.size() > 60) ticks_.pop_front();
  }
  // Metres between where a body is shown and where it was.
  std::optional<double> Error(const client::ShownBody& shown, double tick) const {
    const double back = static_cast<double>(newest_) - tick;
    if (back < 0 || back + 2 > static_cast<double>(ticks_.size())) return std::nullopt;
    const auto later = ticks_.size() - 1 - static_cast<std::size_t>(std::floor(back));
    const double share = 1 - (back - std::floor(back));
    const auto a = ticks_[later - 1].find(shown.id), b = ticks_[later].find(shown.id);
    if (a == ticks_[later - 1].end() || b == ticks_[later].end()) return std::nullopt;
    const Vec3d truth = a->second.position + (b->second.position - a->second.position) * share;
    return Length(shown.pose.position - truth);
  }

 private:
  std::deque<std::map<BodyId, BodyState>> ticks_;
  std::uint64_t newest_ = static_cast<std::uint64_t>(-1);  // tick of the last one: the first pushed is 0
};

// A scene's bodies, joints and fields, stepped.
class Running {
 public:
  explicit Running(const Scene& scene) : scene_(scene), world_({.gravity_m_s2 = scene.gravity_m_s2}) {
    for (const BodyDef& def : scene.bodies) {
      world_.Add(def, def.initial);
      if (def.motion == Motion::kDynamic) bodies_.push_back({def.id, Epoch(1), def.initial});
    }
    for (const JointDef& joint : scene.joints) world_.AddJoint(joint);
  }
  void Step() {
    for (const BodyRecord& body : bodies_) {
      if (body.state.asleep) continue;
      const Vec3d pull = region::FieldAcceleration(scene_.fields, body.state) * world_.MassOf(body.id);
      if (pull != Vec3d()) world_.ApplyForce(body.id, Vec3f(pull), {});
    }
    world_.Step(1.0 / scene_.tick_rate_hz);
    for (BodyRecord& body : bodies_) body.state = world_.StateOf(body.id);
  }
  std::span<const BodyRecord> bodies() const { return bodies_; }

 private:
  const Scene& scene_;
  physics::World world_;
  std::vector<BodyRecord> bodies_;
};

struct Shown {
  std::vector<double> delay_ms;
  std::vector<float> error_m;
  std::size_t decode_errors = 0, jumps = 0, extrapolated = 0;
};

// The far end: the SDK's receiver, clock and world, a frame every 1/60 s.
class Screen {
 public:
  Screen(const Scene& scene, const SnapshotSettings& settings) : receiver_(scene.bounds, settings) {}

  void Take(const Bytes& datagram, double at_ms) {
    const auto got = receiver_.Read(datagram);
    if (!got.ok()) {
      shown.decode_errors += absl::IsAlreadyExists(got.status()) ? 0 : 1;
      return;
    }
    clock_.Arrived(At(at_ms), got->tick);
    world_.Take(At(at_ms), RegionId(1), *got, events_);
    events_.clear();
    any_ = true;
  }
  Bytes Answer() { return std::exchange(any_, false) ? receiver_.WriteAck() : Bytes(); }
  void Frame(double now_ms, const Truth& truth, bool counts) {
    const double tick = clock_.Advance(At(now_ms));
    const std::vector<client::ShownBody> bodies = world_.At(tick, 60);
    if (!counts) return;
    shown.delay_ms.push_back(now_ms - tick * kTick_ms);
    for (const client::ShownBody& body : bodies) {
      const std::optional<double> error_m = truth.Error(body, tick);
      if (!error_m.has_value()) continue;
      shown.error_m.push_back(static_cast<float>(*error_m));
      shown.extrapolated += body.extrapolated ? 1 : 0;
    }
    shown.jumps = clock_.jumps();
  }

  Shown shown;

 private:
  static client::PlayoutClock::TimePoint At(double ms) {
    return client::PlayoutClock::TimePoint(std::chrono::microseconds(1'000'000 + static_cast<std::int64_t>(ms * 1000)));
  }

  SnapshotReceiver receiver_;
  client::PlayoutClock clock_{60, 30};
  client::WorldView world_{60, 2};
  std::vector<client::ClientEvent> events_;
  bool any_ = false;
};

void RenderRow(const Scene& scene, double loss, int seconds, Report& report) {
  Running world(scene);
  const SnapshotSettings settings = SnapshotSettingsFor(scene);
  SnapshotHistory history(scene.bounds, settings);
  SnapshotSender sender(settings);
  Way down(loss, kJitter_ms, 0, 3), up(loss, kJitter_ms, 0, 4);
  Screen screen(scene, settings);
  Truth truth;
  truth.Push(world.bodies());
  double bytes = 0;
  for (int n = 1; n <= seconds * 60; ++n) {
    const double now_ms = n * kTick_ms;
    world.Step();
    truth.Push(world.bodies());
    if (n % 2 == 0) {
      history.Push(Tick(static_cast<std::uint64_t>(n)), world.bodies(), {});
      for (Bytes& datagram : sender.Write(history, 0, 0).datagrams) {
        bytes += static_cast<double>(datagram.size());
        down.Send(now_ms, std::move(datagram));
      }
    }
    down.Deliver(now_ms, [&](const Bytes& datagram, double at_ms) { screen.Take(datagram, at_ms); });
    if (Bytes ack = screen.Answer(); !ack.empty()) up.Send(now_ms, std::move(ack));
    up.Deliver(now_ms, [&](const Bytes& ack, double) { (void)sender.Acknowledge(ack); });
    screen.Frame(now_ms, truth, n > 300);
  }
  const Shown& shown = screen.shown;
  const auto add = [&](const char* metric, double value, const char* unit) {
    report.Add("render", "tessera", absl::StrCat("plaza with ", loss * 100, " % loss"), metric, value, unit);
  };
  const std::vector<double> errors(shown.error_m.begin(), shown.error_m.end());
  add("render_delay_ms_p50", Median(shown.delay_ms), "ms");
  add("render_delay_ms_p95", Quantile(shown.delay_ms, 0.95), "ms");
  add("render_error_m_p50", Median(errors), "m");
  add("render_error_m_p99", Quantile(errors, 0.99), "m");
  add("render_error_m_max", Quantile(errors, 1), "m");
  add("extrapolated_share", static_cast<double>(shown.extrapolated) / static_cast<double>(errors.size()), "1");
  add("decode_errors", static_cast<double>(shown.decode_errors), "1");
  add("playout_jumps", static_cast<double>(shown.jumps), "1");
  add("kbps_mean", bytes * 8 / seconds / 1000, "kbit/s");
}

// --- Joining a running world -----------------------------------------------------------------------------------------

constexpr double kLine_bytes_per_s = 125'000, kNear_m = 25;
constexpr std::size_t kJoinBodies = 5000;

struct Viewer {
  Viewer(const Aabb& bounds, const SnapshotSettings& settings, unsigned seed)
      : sender(settings), receiver(bounds, settings), down(0, 0, kLine_bytes_per_s, seed), up(0, 0, 0, seed + 1) {}

  void See(const SnapshotHistory& history, double now_ms, Vec3d place) {
    for (Bytes& datagram : sender.Write(history, {.centre = place}, 0, 0).datagrams) {
      sent_bytes += static_cast<double>(datagram.size()) + kDatagramOverheadBytes;
      down.Send(now_ms, std::move(datagram));
    }
  }
  void Service(double now_ms) {
    bool any = false;
    down.Deliver(now_ms, [&](const Bytes& datagram, double at_ms) {
      const auto got = receiver.Read(datagram);
      any = true;
      if (!got.ok()) return;
      for (const BodyRecord& body : got->bodies) seen.try_emplace(body.id, at_ms);
    });
    if (any) up.Send(now_ms, receiver.WriteAck());
    up.Deliver(now_ms, [&](const Bytes& ack, double) { (void)sender.Acknowledge(ack); });
  }

  SnapshotSender sender;
  SnapshotReceiver receiver;
  Way down, up;
  double sent_bytes = 0;
  std::map<BodyId, double> seen;  // when first, ms
};

}  // namespace

absl::Status RunLoss(const SuiteOptions& options, Report& report) {
  const CubeTrace trace = RecordCubes(options.quick ? 8 : 54, CubeDrive::kMixed, 1);
  for (const double loss : {0.0, 0.01, 0.05, 0.1}) {
    if (absl::Status status = LossRow(trace, loss, report); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status RunRender(const SuiteOptions& options, Report& report) {
  const absl::StatusOr<std::shared_ptr<const Scene>> scene = LoadPlaza(options.quick ? 100 : 1000);
  if (!scene.ok()) return scene.status();
  for (const double loss : {0.0, 0.1}) {
    RenderRow(**scene, loss, options.quick ? 8 : 25, report);
  }
  return absl::OkStatus();
}

absl::Status RunJoin(const SuiteOptions& options, Report& report) {
  (void)options;  // it is quick as it is
  SnapshotSettings settings;
  settings.client_bytes_per_s = kLine_bytes_per_s;
  MovingBodies world({.count = kJoinBodies, .seed = 5, .world_m = 150, .kicks_per_s = 0.02, .rest_speed_m_s = 0.8});
  for (int n = 0; n < 1200; ++n) world.Step(1.0 / 60);
  SnapshotHistory history(world.bounds(), settings);
  std::deque<Viewer> others;
  for (unsigned i = 0; i < 4; ++i) others.emplace_back(world.bounds(), settings, 10 + 2 * i);
  Viewer newcomer(world.bounds(), settings, 30);
  constexpr int kJoinsAt = 900;  // ticks
  constexpr Vec3d kPlace(10, 1, 10);
  double before_bytes = 0, after_bytes = 0;
  for (int n = 1; n <= kJoinsAt + 600; ++n) {
    const double now_ms = n * kTick_ms;
    world.Step(1.0 / 60);
    if (n % 2 == 0) {
      history.Push(Tick(static_cast<std::uint64_t>(n)), world.bodies(), {});
      for (std::size_t i = 0; i < others.size(); ++i) {
        const double sent = others[i].sent_bytes;
        others[i].See(history, now_ms, Vec3d(-40 + 20.0 * static_cast<double>(i), 1, -20));
        if (n > kJoinsAt - 180 && n <= kJoinsAt) before_bytes += others[i].sent_bytes - sent;
        if (n > kJoinsAt && n <= kJoinsAt + 180) after_bytes += others[i].sent_bytes - sent;
      }
      if (n > kJoinsAt) newcomer.See(history, now_ms, kPlace);
    }
    for (Viewer& other : others) other.Service(now_ms);
    newcomer.Service(now_ms);
    if (newcomer.seen.size() == kJoinBodies && n > kJoinsAt + 180) break;
  }
  if (newcomer.seen.size() != kJoinBodies) {
    return absl::InternalError(absl::StrCat("join: only ", newcomer.seen.size(), " bodies seen after 10 s"));
  }
  double near_ms = 0, complete_ms = 0;
  for (const BodyRecord& body : world.bodies()) {
    const double after_ms = newcomer.seen.at(body.id) - kJoinsAt * kTick_ms;
    complete_ms = std::max(complete_ms, after_ms);
    // Counted by where it is now; a body that has come from afar meanwhile was sent in its turn.
    if (Length(body.state.position - kPlace) < kNear_m && body.state.asleep) near_ms = std::max(near_ms, after_ms);
  }
  const auto add = [&](const char* metric, double value, const char* unit) {
    report.Add("join", "tessera", "5000 bodies over 1 Mbit/s", metric, value, unit);
  };
  add("join_near_ms", near_ms, "ms");
  add("join_complete_ms", complete_ms, "ms");
  add("others_rate_share", after_bytes / before_bytes, "1");
  return absl::OkStatus();
}

}  // namespace tessera::bench
