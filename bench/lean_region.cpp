// The lines of the suite `lean` that need regions, snapshots or the worker's shell.
#include <array>
#include <cassert>
#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <stdexcept>

#include "bench/lean.h"
#include "bench/lockstep.h"
#include "bench/work_counter.h"
#include "core/region/region.h"
#include "core/replication/snapshot.h"
#include "core/replication/testing/moving_bodies.h"
#include "region_worker/snapshot_broadcast.h"
#include "scenes/measured/builder.h"

namespace tessera::bench {
namespace {

using scenes::BoxOf;
using scenes::Builder;
using Counter = std::shared_ptr<const WorkCounter>;

constexpr double kHalf_m = 256;  // half of the world's side
constexpr int kTicks = 5;        // a unit

enum class Halves { kLeft, kRight, kBoth };

// Stacks of cubes about x = -128, x = 128 or both; awake, or asleep.
std::shared_ptr<const Scene> Heaps(Halves halves, bool asleep = false) {
  Builder make("heaps");
  make.Ground();
  const ShapePtr cube = BoxOf(0.5, 0.5, 0.5);
  for (const double middle : {-kHalf_m / 2, kHalf_m / 2}) {
    if ((halves == Halves::kLeft && middle > 0) || (halves == Halves::kRight && middle < 0)) continue;
    for (int i = 0; i < 64; ++i) {
      for (int y = 0; y < 4; ++y) {
        BodyDef& box = make.Dynamic(cube, {middle + i % 8 * 3, 0.5 + y, i / 8 * 3.0}, 1);
        box.may_sleep = box.initial.asleep = asleep;
      }
    }
  }
  Scene scene = make.Take();
  scene.bounds = {{-kHalf_m, -kHalf_m, -kHalf_m}, {kHalf_m, kHalf_m, kHalf_m}};
  return std::make_shared<const Scene>(std::move(scene));
}

template <class Function>
WorkUnit Ticking(Counter counter, Function tick) {
  return [counter, tick] {
    return counter->Of([&] {
      for (int i = 0; i < kTicks; ++i) tick();
    });
  };
}

WorkUnit Ticking(Counter counter, std::vector<std::shared_ptr<Lockstep>> instances) {
  return Ticking(counter, [instances] {
    for (const auto& instance : instances) instance->Tick();
  });
}

std::shared_ptr<Lockstep> Start(const std::shared_ptr<const Scene>& scene, std::uint32_t regions) {
  return std::make_shared<Lockstep>(scene, *MakeGridMap(scene->ground(), regions), region::RegionSettings());
}

// A region where all sleep, beside one where nothing does.
LeanPair IdleRegion(const Counter& counter) {
  return {Ticking(counter, {Start(Heaps(Halves::kLeft), 1)}),
          Ticking(counter, {Start(Heaps(Halves::kLeft), 1), Start(Heaps(Halves::kRight, true), 1)})};
}

// Two halves that know nothing of each other, and the same two with a border that nobody is near.
LeanPair QuietBorder(const Counter& counter) {
  return {Ticking(counter, {Start(Heaps(Halves::kLeft), 1), Start(Heaps(Halves::kRight), 1)}),
          Ticking(counter, {Start(Heaps(Halves::kBoth), 2)})};
}

// Two regions as above: their ticks, and those less what prediction took in them.
LeanPair PredictionFarFromBorders(const Counter& counter) {
  struct Seen {
    double entered = 0, all = 0, prediction = 0;
    bool predicting = false;
  };
  const auto instance = Start(Heaps(Halves::kBoth), 2);
  const auto seen = std::make_shared<Seen>();
  const auto run = [=] {
    *seen = {};
    seen->all = counter->Of([&] {
      for (int i = 0; i < kTicks; ++i) {
        instance->Tick([&](region::Phase phase) {
          const double now = counter->Now();
          if (seen->predicting) seen->prediction += now - seen->entered;
          seen->predicting = phase == region::Phase::kPrediction;
          seen->entered = now;
        });
      }
    });
  };
  // Both figures of a unit come from one run: `with` or `without`, whichever is asked first, makes it.
  const auto fresh = std::make_shared<int>(0);  // 1: `with` has been asked, -1: `without`
  const auto ask = [=](int who) {
    if (*fresh == 0 || *fresh == who) {
      run();
      *fresh = who;
    } else {
      *fresh = 0;
    }
  };
  return {[=] { return ask(-1), seen->all - seen->prediction; }, [=] { return ask(1), seen->all; }};
}

// A region's ticks, and the same with the broadcast of snapshots that has no client.
LeanPair EncodingWithoutSubscribers(const Counter& counter) {
  struct Shell {
    std::shared_ptr<const Scene> scene = Heaps(Halves::kLeft);
    std::shared_ptr<Lockstep> regions = Start(scene, 1);
    worker::WorkerMetrics metrics;
    worker::GamePort port;
    worker::SnapshotBroadcast broadcast{RegionId(1), *scene, 30, {}, metrics};
    explicit Shell(std::unique_ptr<net::Endpoint> endpoint) : port(std::move(endpoint), metrics) {}
  };
  auto endpoint = net::Endpoint::Create({.bind_address = "127.0.0.1", .port = 0, .max_peers = 1});
  if (!endpoint.ok()) throw std::runtime_error(endpoint.status().ToString());
  const auto shell = std::make_shared<Shell>(*std::move(endpoint));
  return {Ticking(counter, {Start(Heaps(Halves::kLeft), 1)}), Ticking(counter, [shell] {
            shell->regions->Tick();
            shell->broadcast.AfterTick(shell->regions->region(0), {}, nullptr, shell->port);
          })};
}

// A region's ticks, and the same with what the worker counts and times in each, which nobody reads.
LeanPair MetricsNobodyReads(const Counter& counter) {
  const auto instance = Start(Heaps(Halves::kLeft), 1);
  const auto metrics = std::make_shared<worker::WorkerMetrics>();
  return {Ticking(counter, {Start(Heaps(Halves::kLeft), 1)}), Ticking(counter, [instance, metrics] {
            using Clock = std::chrono::steady_clock;
            std::array<Clock::time_point, static_cast<std::size_t>(region::Phase::kDone) + 1> entered{};
            instance->Tick([&](region::Phase phase) { entered[static_cast<std::size_t>(phase)] = Clock::now(); });
            const auto length_of = [&](region::Phase phase) {
              const auto index = static_cast<std::size_t>(phase);
              return std::chrono::duration<double>(entered[index + 1] - entered[index]).count();
            };
            metrics->physics.Observe(length_of(region::Phase::kPhysics));
            metrics->prediction.Observe(length_of(region::Phase::kPrediction));
            metrics->step.Observe(length_of(region::Phase::kPhysics));
            metrics->ticks.Increment();
            metrics->tick.Set(static_cast<double>(instance->region(0).tick().value()));
            metrics->owned.Set(static_cast<double>(instance->region(0).owned().size()));
            metrics->ghosts.Set(static_cast<double>(instance->region(0).ghost_count()));
            metrics->asleep.Set(static_cast<double>(instance->region(0).asleep_count()));
          })};
}

// One client of a region whose bodies move, and who has long been sent those that rest.
class Viewed {
 public:
  explicit Viewed(std::size_t resting) : moving_({.count = 200, .world_m = 2 * kHalf_m}), bodies_(moving_.bodies()) {
    for (std::size_t i = 0; i < resting; ++i) {
      replication::BodyRecord body{.id = BodyId(10'000 + i), .epoch = Epoch(1), .state = {}};
      body.state.position = {static_cast<double>(i % 64), 0.5, static_cast<double>(i) / 64};
      body.state.asleep = true;
      bodies_.push_back(body);
    }
    for (int i = 0; i < 60; ++i) Tick();  // until all is acknowledged
  }
  // Bytes sent.
  double Tick() {
    moving_.Step(1.0 / 60);
    std::copy(moving_.bodies().begin(), moving_.bodies().end(), bodies_.begin());
    // As the worker does: all bodies at first, then those that move.
    ++tick_;
    history_.Push(tessera::Tick(tick_), tick_ == 1 ? bodies_ : moving_.bodies(), {});
    double bytes = 0;
    for (const replication::Bytes& datagram : sender_.Write(history_, 0, 0).datagrams) {
      bytes += static_cast<double>(datagram.size());
      if (const auto read = receiver_.Read(datagram); !read.ok()) throw std::runtime_error(read.status().ToString());
    }
    if (const absl::Status status = sender_.Acknowledge(receiver_.WriteAck()); !status.ok()) {
      throw std::runtime_error(status.ToString());
    }
    return bytes;
  }

 private:
  replication::MovingBodies moving_;
  std::vector<replication::BodyRecord> bodies_;
  replication::SnapshotSettings settings_;
  replication::SnapshotHistory history_{moving_.bounds(), settings_};
  replication::SnapshotSender sender_{settings_};
  replication::SnapshotReceiver receiver_{moving_.bounds(), settings_};
  std::uint64_t tick_ = 0;
};

constexpr std::size_t kResting = 2000;

WorkUnit BytesOf(std::size_t resting) {
  const auto viewed = std::make_shared<Viewed>(resting);
  return [viewed] { return viewed->Tick(); };
}

WorkUnit WorkOf(const Counter& counter, std::size_t resting) {
  const auto viewed = std::make_shared<Viewed>(resting);
  return Ticking(counter, [viewed] { viewed->Tick(); });
}

}  // namespace

std::vector<LeanLine> RegionLines() {
  const auto counter = std::make_shared<const WorkCounter>();
  const std::string counted = counter->unit();
  return {
      {"idle_region", counted, [=] { return IdleRegion(counter); }},
      {"quiet_border", counted, [=] { return QuietBorder(counter); }},
      {"prediction_far_from_borders", counted, [=] { return PredictionFarFromBorders(counter); }},
      {"encoding_without_subscribers", counted, [=] { return EncodingWithoutSubscribers(counter); }},
      {"unchanged_bodies_sent", "bytes",
       [] {
         return LeanPair{BytesOf(0), BytesOf(kResting)};
       }},
      {"unchanged_bodies_encoded", counted,
       [=] {
         return LeanPair{WorkOf(counter, 0), WorkOf(counter, kResting)};
       }},
      {"metrics_nobody_reads", counted, [=] { return MetricsNobodyReads(counter); }},
  };
}

}  // namespace tessera::bench
