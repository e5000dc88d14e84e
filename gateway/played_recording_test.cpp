// One viewer's way through a recording, with the time of a test: what is shown where, and what harms nobody.
#include "gateway/played_recording.h"

#include <gmock/gmock.h>

#include <condition_variable>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>

#include "client_sdk/recorder.h"
#include "core/world/byte_view.h"
#include "core/world/packed_scene.h"
#include "core/world/partition_map.h"
#include "core/world/scene_load.h"
#include "host/temporary_folder.h"

namespace tessera::gateway {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::HasSubstr;

constexpr double kSpeed_m_s = 2;
constexpr int kSeconds = 20;

class PlayedRecordingTest : public testing::Test {
 protected:
  PlayedRecordingTest()
      : background_(2, [this] {
          const std::lock_guard lock(mutex_);
          ++woken_;
          wake_.notify_all();
        }) {
    services_.background = &background_;
    Write();
  }

  // A ball that rolls along x from -20 m on, a goal every five seconds, and what a gateway notes.
  void Write() {
    const auto loaded = LoadScene(SceneForm::kText, R"(
      name: "plaza" bounds { min { x: -50 y: -5 z: -50 } max { x: 50 y: 50 z: 50 } }
      instance_properties { name: "red" number: 0 } instance_properties { name: "phase" text: "play" }
      instance_properties { name: "seed" number: 7 visible_to: VISIBILITY_SERVERS }
      bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
      bodies { id: 2 mass: 1 shape { sphere { radius: 0.5 } } })",
                                  "plaza.textproto");
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    const client::RecordingHeader header{.instance_id = "plaza-1",
                                         .player = PlayerNumber(1),
                                         .tick_rate_hz = 60,
                                         .snapshot_rate_hz = 30,
                                         .started = true,
                                         .map = client::WrittenMap(*MakeGridMap(loaded->scene->ground(), 1)),
                                         .scene = std::string(AsText(PackScene(*loaded->scene)))};
    auto writer = client::RecordingWriter::Create(path(), header, 10'000'000);
    ASSERT_TRUE(writer.ok()) << writer.status();
    client::Recorder recorder(*std::move(writer), *loaded->scene, header);
    const client::TimePoint begin{1h};
    for (int step = 0; step < 30 * kSeconds; ++step) {
      const client::TimePoint at = begin + step * 33'333us;
      if (step == 0) recorder.Region(at, RegionId(1), client::RegionEntry::Change::kBegins);
      if (step % 30 == 0) {
        recorder.Note(
            at,
            json({{"type", "status"}, {"age_s", step / 30}, {"regions", {{{"region", 1}, {"host", "alpha"}}}}}).dump());
      }
      if (step > 0 && step % 150 == 0) {
        PropertySet set;
        ASSERT_TRUE(set.Set(loaded->scene->instance_properties, "red", std::int64_t{step / 150}).ok());
        recorder.World(at, set.Encode());
      }
      if (step == 240) {
        recorder.Note(at, R"({"type":"events","events":[{"time":"2026-01-01T00:00:08Z","text":"region 1 died"}]})");
        recorder.Note(at, R"({"type":"events","events":[7,{"text":8},{"text":"x","time":"never"}]})");
        recorder.Note(at, "no json");
      }
      replication::ReceivedSnapshot snapshot;
      snapshot.tick = Tick(static_cast<std::uint64_t>(2 * step + 2));
      BodyState state;
      state.position = {-20 + kSpeed_m_s * step / 30.0, 0.5, 0};
      state.linear_velocity = {kSpeed_m_s, 0, 0};
      snapshot.bodies.push_back({BodyId(2), Epoch(1), state});
      recorder.Snapshot(at, RegionId(1), snapshot);
      ASSERT_TRUE(recorder.Flush(at).ok());
    }
    ASSERT_TRUE(recorder.Close().ok());
  }
  std::string path() const { return folder_.path() + "/match.rec"; }

  // A frame of the gateway's loop.
  void Frame(PlayedRecording& played) {
    background_.Finish();
    played.Tick(now_ += 16ms, true);
  }
  // Frames until it has arrived where it was sent.
  void Arrive(PlayedRecording& played) {
    const auto before = played.news()->play_number;
    played.Tick(now_ += 1ms, true);
    while (!played.problem() && played.news()->play_number == before) {
      std::unique_lock lock(mutex_);
      ASSERT_TRUE(wake_.wait_for(lock, 60s, [&] { return woken_ > finished_; }));
      finished_ = woken_;
      lock.unlock();
      background_.Finish();
      played.Tick(now_ += 1ms, true);
    }
  }
  static json Said(const PlayedRecording& played) { return json::parse(played.news()->play); }
  static double Place(const PlayedRecording& played) { return Said(played).at("at_s"); }
  // Where the ball is shown; NaN if it is not.
  static double Ball(const PlayedRecording& played) {
    if (played.view() == nullptr || played.view()->picture == nullptr) return NAN;
    for (const PictureBody& body : played.view()->picture->bodies) {
      if (body.id == BodyId(2)) return static_cast<double>(body.position[0]) / 1024;
    }
    return NAN;
  }
  static json World(const PlayedRecording& played) { return json::parse(played.view()->world).at("properties"); }
  // A ball is shown some snapshots after it was there.
  static double BallAt(double place_s) { return -20 + kSpeed_m_s * (place_s - 0.08); }

  host::TemporaryFolder folder_;
  std::mutex mutex_;
  std::condition_variable wake_;
  int woken_ = 0, finished_ = 0;
  Services services_;
  Background background_;
  PlayedRecording::TimePoint now_{100h};
};

TEST_F(PlayedRecordingTest, PlaysAtItsPaceAndAnother) {
  PlayedRecording played("match.rec", path(), services_);
  EXPECT_EQ(played.view(), nullptr) << "it is read off the loop";
  ASSERT_NO_FATAL_FAILURE(Arrive(played));
  EXPECT_EQ(Said(played).at("file"), "match.rec");
  EXPECT_NEAR(Said(played).at("end_s").get<double>(), kSeconds, 0.1);
  EXPECT_EQ(Said(played).at("paused"), false);
  for (int i = 0; i < 300; ++i) Frame(played);
  EXPECT_NEAR(Place(played), 4.8, 0.3);
  EXPECT_NEAR(Ball(played), BallAt(4.8), 0.2);
  EXPECT_FALSE(played.view()->picture->paused);
  EXPECT_EQ(json::parse(played.news()->status).at("age_s"), 4) << "what was told then";
  played.Take({.speed = 4});
  for (int i = 0; i < 100; ++i) Frame(played);
  EXPECT_NEAR(Place(played), 4.8 + 6.4, 1.1);
  EXPECT_NEAR(Ball(played), BallAt(4.8 + 6.4), 0.3);
  ASSERT_EQ(played.news()->events.kept.size(), 1u) << "what is no event is passed over";
  EXPECT_EQ(played.news()->events.kept[0].text(), "region 1 died");
}

TEST_F(PlayedRecordingTest, StandsWhereItIsPausedAndSteps) {
  PlayedRecording played("match.rec", path(), services_);
  ASSERT_NO_FATAL_FAILURE(Arrive(played));
  for (int i = 0; i < 200; ++i) Frame(played);
  played.Take({.paused = true});
  Frame(played);
  Frame(played);
  const double place = Place(played), ball = Ball(played);
  for (int i = 0; i < 50; ++i) Frame(played);
  EXPECT_EQ(Place(played), place);
  EXPECT_NEAR(Ball(played), ball, 0.01);
  EXPECT_TRUE(played.view()->picture->paused) << "viewers need no frames";
  for (int i = 0; i < 6; ++i) {
    played.Take({.step = 1});
    Frame(played);
    EXPECT_FALSE(played.view()->picture->paused);
  }
  EXPECT_NEAR(Place(played), place + 0.1, 1e-3);
  EXPECT_GT(Ball(played), ball);
  played.Take({.step = -6});
  ASSERT_NO_FATAL_FAILURE(Arrive(played));
  EXPECT_NEAR(Place(played), place, 1e-3);
  EXPECT_NEAR(Ball(played), ball, 0.1);
  EXPECT_EQ(Said(played).at("paused"), true);
}

TEST_F(PlayedRecordingTest, GoesAnywhereAndBackFromItsEnd) {
  PlayedRecording played("match.rec", path(), services_);
  ASSERT_NO_FATAL_FAILURE(Arrive(played));
  const std::uint64_t generation = played.view()->generation;
  for (const double place_s : {15.0, 3.0, 9.0}) {
    played.Take({.paused = true, .at_s = place_s});
    ASSERT_NO_FATAL_FAILURE(Arrive(played));
    EXPECT_NEAR(Place(played), place_s, 1e-6);
    EXPECT_NEAR(Ball(played), BallAt(place_s), 0.1);
  }
  EXPECT_EQ(played.view()->generation, generation) << "the level is not sent again";
  played.Take({.paused = false, .at_s = 1e9});
  ASSERT_NO_FATAL_FAILURE(Arrive(played));
  EXPECT_NEAR(Place(played), kSeconds, 0.1);
  for (int i = 0; i < 50; ++i) Frame(played);
  EXPECT_EQ(Said(played).at("paused"), true) << "it stays at its end";
  EXPECT_FALSE(played.problem());
  played.Take({.paused = false});
  ASSERT_NO_FATAL_FAILURE(Arrive(played));
  EXPECT_LT(Place(played), 1) << "from its end it begins again";
  // A person who drags a slider asks faster than it can go: the last place counts.
  for (int i = 0; i <= 100; ++i) played.Take({.paused = true, .at_s = 0.1 * i});
  ASSERT_NO_FATAL_FAILURE(Arrive(played));
  while (Place(played) != 10) ASSERT_NO_FATAL_FAILURE(Arrive(played));
  EXPECT_NEAR(Ball(played), BallAt(10), 0.1);
}

TEST_F(PlayedRecordingTest, TheWorldsPropertiesAreThoseOfTheMoment) {
  PlayedRecording played("match.rec", path(), services_);
  ASSERT_NO_FATAL_FAILURE(Arrive(played));
  EXPECT_EQ(World(played), (json{{"red", 0}, {"phase", "play"}})) << "and none that only servers see";
  for (int i = 0; i < 400; ++i) Frame(played);
  EXPECT_EQ(World(played).at("red"), 1);
  for (const double place_s : {18.0, 3.0, 14.0, 6.0}) {
    const std::uint64_t before = played.view()->world_number;
    played.Take({.paused = true, .at_s = place_s});
    ASSERT_NO_FATAL_FAILURE(Arrive(played));
    EXPECT_EQ(World(played).at("red"), static_cast<int>(place_s / 5)) << place_s;
    EXPECT_EQ(played.view()->world_number, before + 1) << "viewers are told once";
  }
}

// A death at 8 s, of which the keys after it know nothing.
TEST_F(PlayedRecordingTest, WhatHadHappenedByThenIsKnownWhereverOneGoes) {
  PlayedRecording played("match.rec", path(), services_);
  ASSERT_NO_FATAL_FAILURE(Arrive(played));
  EXPECT_TRUE(played.news()->events.kept.empty());
  for (const double place_s : {7.0, 18.0, 3.0, 19.0, 8.5}) {
    played.Take({.paused = true, .at_s = place_s});
    ASSERT_NO_FATAL_FAILURE(Arrive(played));
    const bool has_died = place_s != 7.0;
    ASSERT_EQ(played.news()->events.kept.size(), has_died ? 1U : 0U) << place_s;
    EXPECT_TRUE(!has_died || played.news()->events.kept[0].text() == "region 1 died");
  }
}

TEST_F(PlayedRecordingTest, WhatCannotBePlayedIsAProblemThatNamesItAndNoFolder) {
  PlayedRecording missing("../x", absl::NotFoundError("the gateway has no recording of that name"), services_);
  ASSERT_TRUE(missing.problem());
  EXPECT_EQ(missing.problem()->code, "no_recording");
  std::ifstream in(path(), std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  bytes[bytes.size() / 2] ^= 1;
  std::ofstream(path(), std::ios::binary) << bytes;
  PlayedRecording damaged("match.rec", path(), services_);
  ASSERT_NO_FATAL_FAILURE(Arrive(damaged));
  ASSERT_TRUE(damaged.problem());
  EXPECT_EQ(damaged.problem()->code, "damaged");
  EXPECT_THAT(damaged.problem()->text, HasSubstr("match.rec: damaged at byte"));
  EXPECT_THAT(damaged.problem()->text, testing::Not(HasSubstr(folder_.path())));
  damaged.Take({.at_s = 3});
  Frame(damaged);  // does no harm
}

TEST_F(PlayedRecordingTest, WhoLeavesWhileItIsReadHarmsNobody) {
  for (int i = 0; i < 20; ++i) PlayedRecording("match.rec", path(), services_).Take({.at_s = 5});
  PlayedRecording played("match.rec", path(), services_);
  ASSERT_NO_FATAL_FAILURE(Arrive(played));
  EXPECT_FALSE(played.problem());
}

}  // namespace
}  // namespace tessera::gateway
