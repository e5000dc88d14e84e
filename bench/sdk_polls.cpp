// The cost of polls, in instructions of the client's thread or, where the kernel does not count them, in its CPU time:
// the first ones of a large scene, and those after a pause.
#include <algorithm>
#include <filesystem>
#include <limits>
#include <stdexcept>

#include "bench/sdk.h"
#include "bench/sdk_stage.h"
#include "bench/statistics.h"
#include "bench/work_counter.h"
#include "client_sdk/client.h"
#include "client_sdk/scene_keeper.h"
#include "core/world/packed_scene.h"

namespace tessera::bench {
namespace {

using client::Client;
using client::TimePoint;
using std::chrono::nanoseconds;

constexpr nanoseconds kFrame{1'000'000'000 / client::kTickRate};
constexpr int kFirst = 600, kUsual = 120;  // polls
constexpr double kFrames_per_s = client::kTickRate;

// Hills of so many squares of a metre each way, two triangles each.
BodyDef Hills(std::uint32_t squares) {
  TriangleMeshShape mesh;
  const std::uint32_t side = squares + 1;
  for (std::uint32_t z = 0; z < side; ++z) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const double at_x = x - squares / 2.0, at_z = z - squares / 2.0;
      mesh.vertices.push_back(Vec3f(Vec3d{at_x, 0.3 * std::sin(at_x * 0.7) * std::cos(at_z * 0.5), at_z}));
    }
  }
  for (std::uint32_t z = 0; z + 1 < side; ++z) {
    for (std::uint32_t x = 0; x + 1 < side; ++x) {
      const std::uint32_t i = z * side + x;
      mesh.triangles.push_back({i, i + side, i + 1});
      mesh.triangles.push_back({i + 1, i + side, i + side + 1});
    }
  }
  BodyDef def;
  def.id = BodyId(1'000'000);
  def.shape = std::make_shared<const Shape>(Shape{std::move(mesh)});
  def.motion = Motion::kStatic;
  def.mass_kg = 0;
  return def;
}

std::vector<BodyDef> Balls(std::size_t count) {
  std::vector<BodyDef> balls;
  const auto ball = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
  for (std::size_t i = 1; i <= count; ++i) {
    BodyDef& def = balls.emplace_back();
    def.id = BodyId(i);
    def.shape = ball;
  }
  return balls;
}

// A client in the stage's world, driven in virtual time: one poll a frame, a snapshot with every other.
struct Driven {
  Driven(SdkStage& stage_in, std::size_t bodies_in, const std::string& folder) : stage(stage_in), bodies(bodies_in) {
    client::GrantOptions options;
    options.bind_address = "127.0.0.1";
    options.predict = true;
    options.scene_cache_dir = folder;
    const std::vector<std::uint8_t> grant = stage.Grant();
    join = counter.Of([&] {
      auto joined = Client::JoinByGrant(grant, options);
      if (!joined.ok()) throw std::runtime_error(std::string(joined.status().message()));
      client = *std::move(joined);
    });
  }
  // The work of one poll and of what is drawn after it.
  double Frame() {
    Advance();
    return counter.Of([&] {
      (void)client->Poll(now);
      (void)client->Interpolated(now);
    });
  }
  void Advance() {
    ++frame;
    now += kFrame;
    if (frame % 2 == 0) {
      tick = tick + 2;
      stage.region.Snapshot(tick, MovingBodiesAt(bodies, static_cast<double>(frame) / kFrames_per_s));
    }
    stage.region.Service();
  }

  SdkStage& stage;
  std::size_t bodies;
  WorkCounter counter;
  std::unique_ptr<Client> client;
  double join = 0;
  int frame = 0;
  TimePoint now{std::chrono::hours(1)};
  Tick tick;
};

void KeepScene(const SdkStage& stage, const std::string& folder) {
  std::vector<std::uint8_t> packed = PackScene(*stage.scene);
  client::SceneKeeper keeper(folder + "/" + std::string(64, 'a') + "." + std::to_string(kPackedSceneVersion) + ".tsrs",
                             std::move(packed));
  client::WorkBudget budget = client::WorkBudget::Unlimited();
  keeper.Go(budget);
}

}  // namespace

void MeasureFirstPolls(bool quick, Report& report) {
  const std::uint32_t squares = quick ? 200 : 700;
  const host::TemporaryFolder folder;
  SdkStage stage(SdkScene({Hills(squares)}));
  KeepScene(stage, folder.path());
  std::vector<double> ratios, after_s;
  std::string unit;
  for (int run = 0; run < (quick ? 1 : 5); ++run) {
    Driven driven(stage, 0, folder.path());
    unit = driven.counter.unit();
    double dearest = driven.join;
    int predicting = 0;
    for (int i = 1; i <= kFirst; ++i) {
      dearest = std::max(dearest, driven.Frame());
      if (predicting == 0 && driven.client->Stats().predicting) predicting = i;
    }
    std::vector<double> later;
    later.reserve(kFirst);
    for (int i = 0; i < kFirst; ++i) later.push_back(driven.Frame());
    ratios.push_back(dearest / Quantile(later, 0.99));
    after_s.push_back(predicting == 0 ? std::numeric_limits<double>::infinity() : predicting / kFrames_per_s);
  }
  const std::string config = "triangles=" + std::to_string(2 * squares * squares);
  report.Add("first_polls", "tessera", config, "first_polls_ratio", Median(ratios), "1");
  report.Add("first_polls", "tessera", config, "first_polls_ratio_worst", *std::ranges::max_element(ratios), "1");
  report.Add("first_polls", "tessera", config, "predicting_after_s", Median(after_s), "s");
  report.Add("first_polls", "tessera", config, "counted_in_" + unit, 1, "1");
}

void MeasureLatePolls(bool quick, Report& report) {
  constexpr std::size_t kBodies = 2000;
  SdkStage stage(SdkScene(Balls(kBodies)));
  std::vector<double> polls, ratios, usual_work;
  std::string unit;
  Driven driven(stage, kBodies, "");
  unit = driven.counter.unit();
  for (int i = 0; i < kFirst; ++i) driven.Frame();
  for (int run = 0; run < (quick ? 2 : 10); ++run) {
    std::vector<double> usual;
    usual.reserve(kUsual);
    for (int i = 0; i < kUsual; ++i) usual.push_back(driven.Frame());
    usual_work.push_back(Quantile(usual, 0.5));
    for (int i = 0; i < static_cast<int>(client::kTickRate); ++i) driven.Advance();
    int needed = 0;
    double dearest = 0;
    const Tick newest = driven.tick;
    while (driven.client->tick() < newest && needed < 600) {
      ++needed;
      dearest = std::max(dearest, driven.counter.Of([&] {
        (void)driven.client->Poll(driven.now);
        (void)driven.client->Interpolated(driven.now);
      }));
      driven.now += kFrame;
      driven.stage.region.Service();
    }
    for (int i = 0; i < 10; ++i) dearest = std::max(dearest, driven.Frame());
    polls.push_back(needed);
    ratios.push_back(dearest / Quantile(usual, 0.9));
    for (int i = 0; i < 60; ++i) driven.Frame();
  }
  const std::string config = "bodies=" + std::to_string(kBodies);
  report.Add("late_polls", "tessera", config, "catch_up_polls", *std::ranges::max_element(polls), "1");
  report.Add("late_polls", "tessera", config, "late_poll_ratio", Median(ratios), "1");
  report.Add("late_polls", "tessera", config, "late_poll_ratio_worst", *std::ranges::max_element(ratios), "1");
  report.Add("late_polls", "tessera", config, "frame_" + unit, Median(usual_work), unit == "instructions" ? "1" : "s");
  report.Add("late_polls", "tessera", config, "datagrams_passed_over",
             static_cast<double>(driven.client->Stats().datagrams_passed_over), "1");
}

}  // namespace tessera::bench
