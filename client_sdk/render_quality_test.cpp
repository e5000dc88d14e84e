// A viewer's picture over a bad network against the truth: snapshots of falling and tumbling bodies at 30 a second, a
// tenth of them lost, the others up to 50 ms late, acknowledgements the same. All in virtual time.
#include <gtest/gtest.h>

#include <cmath>

#include "client_sdk/delay_line.h"
#include "client_sdk/playout_clock.h"
#include "client_sdk/world_view.h"
#include "core/physics/world.h"
#include "core/replication/snapshot.h"
#include "core/world/scene_io.h"

namespace tessera::client {
namespace {

using std::chrono::milliseconds;

std::shared_ptr<const Scene> Tumble() {
  std::string text = R"(name: "tumble" bounds { min { x: -50 y: -5 z: -50 } max { x: 50 y: 50 z: 50 } }
    bodies { id: 1 motion: MOTION_STATIC pose { position { y: -0.5 } } shape { box { half_extents { x: 50 y: 0.5 z: 50 } } } } )";
  for (int i = 0; i < 40; ++i) {
    const std::string at = "pose { position { x: " + std::to_string((i % 7) * 1.1) +
                           " y: " + std::to_string(2 + 0.6 * i) + " z: " + std::to_string((i % 5) * 1.2) +
                           " } } linear_velocity { x: " + std::to_string(std::sin(i) * 4) +
                           " z: " + std::to_string(std::cos(i) * 4) + " }";
    text += "bodies { id: " + std::to_string(10 + i) + " mass: 1 " + at +
            (i % 2 == 0 ? " shape { sphere { radius: 0.4 } } }\n"
                        : " shape { box { half_extents { x: 0.4 y: 0.3 z: 0.5 } } } }\n");
  }
  // Something moves all the time, so that the rhythm goes on.
  text +=
      "bodies { id: 99 mass: 1 gravity_scale: 0 pose { position { x: -40 y: 40 } } linear_velocity { x: 2 } "
      "never_sleeps: true shape { sphere { radius: 0.4 } } }\n";
  const auto written = ParseScene(text, "tumble.textproto");
  EXPECT_TRUE(written.ok()) << written.status();
  return *ResolveScene(*written, "tumble.textproto");
}

double Quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values.at(static_cast<std::size_t>(q * static_cast<double>(values.size() - 1)));
}

struct Seen {
  double delay_p95_s = 0, error_p99_m = 0;
  std::size_t errors = 0, poses = 0;
};

Seen Watch(const NetworkConditions& conditions, double seconds) {
  const auto scene = Tumble();
  physics::World world({.origin = {}, .gravity_m_s2 = scene->gravity_m_s2});
  std::vector<BodyId> ids;
  for (const BodyDef& def : scene->bodies) {
    world.Add(def, def.initial);
    if (def.motion == Motion::kDynamic) ids.push_back(def.id);
  }
  const replication::SnapshotSettings settings = replication::SnapshotSettingsFor(*scene);
  replication::SnapshotHistory history(scene->bounds, settings);
  replication::SnapshotSender sender(settings);
  replication::SnapshotReceiver receiver(scene->bounds, settings);
  DelayLine<replication::Bytes> down, up;
  down.Seed(conditions.seed);
  up.Seed(conditions.seed + 1);
  WorldView view(60, 2);
  PlayoutClock playout(60, 30);
  std::vector<ClientEvent> events;
  std::vector<std::map<BodyId, Vec3d>> truth(1);
  for (const BodyId id : ids) truth[0][id] = world.StateOf(id).position;

  Seen result;
  std::vector<double> delays, errors;
  TimePoint now{std::chrono::hours(1)};
  for (int ms = 1; ms <= static_cast<int>(seconds * 1000); ++ms) {
    now += milliseconds(1);
    const auto tick = static_cast<std::size_t>(ms * 60 / 1000);
    if (tick == truth.size()) {
      world.Step(1.0 / 60);
      truth.emplace_back();
      std::vector<replication::BodyRecord> records;
      for (const BodyId id : ids) {
        truth.back()[id] = world.StateOf(id).position;
        records.push_back({id, Epoch(1), world.StateOf(id)});
      }
      if (tick % 2 == 0) {
        history.Push(Tick(tick), records, {});
        for (auto& bytes : sender.Write(history, 0, 0).datagrams) down.Put(now, std::move(bytes), conditions);
      }
    }
    for (const auto& bytes : up.Take(now)) EXPECT_TRUE(sender.Acknowledge(bytes).ok());
    bool any = false;
    for (const auto& bytes : down.Take(now)) {
      const auto snapshot = receiver.Read(bytes);
      if (!snapshot.ok()) {
        result.errors += absl::IsAlreadyExists(snapshot.status()) ? 0 : 1;
        continue;
      }
      any = true;
      playout.Arrived(now, snapshot->tick);
      view.Take(now, RegionId(1), *snapshot, events);
    }
    if (any) up.Put(now, receiver.WriteAck(), conditions);
    if (ms % 7 != 0) continue;  // frames, at 143 Hz
    const double shown_tick = playout.Advance(now);
    if (ms < 2000) continue;  // the rhythm is known by then
    delays.push_back(ms / 1000.0 - shown_tick / 60);
    const auto before = static_cast<std::size_t>(shown_tick);
    if (before + 1 >= truth.size()) continue;
    const double share = shown_tick - std::floor(shown_tick);
    for (const ShownBody& body : view.At(shown_tick, 60)) {
      const Vec3d a = truth[before].at(body.id), b = truth[before + 1].at(body.id);
      errors.push_back(Length(body.pose.position - (a + (b - a) * share)));
    }
  }
  result.delay_p95_s = Quantile(delays, 0.95);
  result.error_p99_m = Quantile(errors, 0.99);
  result.poses = errors.size();
  return result;
}

TEST(RenderQualityTest, ATenthLostAndFiftyMillisecondsOfJitterAreHardlySeen) {
  const Seen seen = Watch({.loss = 0.1, .jitter = milliseconds(50), .seed = 7}, 12);
  RecordProperty("delay_p95_ms", static_cast<int>(seen.delay_p95_s * 1000));
  RecordProperty("error_p99_mm", static_cast<int>(seen.error_p99_m * 1000));
  std::printf("delay P95 %.1f ms, error P99 %.2f mm over %zu poses\n", seen.delay_p95_s * 1e3, seen.error_p99_m * 1e3,
              seen.poses);
  EXPECT_LE(seen.delay_p95_s, 0.150);
  EXPECT_LE(seen.error_p99_m, 0.02);
  EXPECT_EQ(seen.errors, 0u);
  EXPECT_GT(seen.poses, 10'000u);
}

TEST(RenderQualityTest, APerfectNetworkCostsTwoSnapshots) {
  const Seen seen = Watch({}, 8);
  EXPECT_LE(seen.delay_p95_s, 0.085);
  EXPECT_LE(seen.error_p99_m, 0.01);
  EXPECT_EQ(seen.errors, 0u);
}

}  // namespace
}  // namespace tessera::client
