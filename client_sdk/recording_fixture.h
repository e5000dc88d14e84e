// RecordingTest: a client that records a match, and a file that is written without one.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/client_fixture.h"
#include "client_sdk/recorder.h"
#include "client_sdk/recording.h"

namespace tessera::client {

// The bodies that a game sees in a frame, and the number of events up to it.
struct RecordedFrame {
  TimePoint time;
  std::vector<ShownBody> bodies;
  std::size_t events = 0;
};

class RecordingTest : public ClientFixture {
 protected:
  void SetUp() override { file = testing::TempDir() + "recording_test_" + std::to_string(::getpid()) + ".tsr"; }
  void TearDown() override { std::remove(file.c_str()); }

  void Look() { seen.push_back({now, client->Interpolated(now), events.size()}); }

  // A ball rolls from the region in the west to the one in the east; another one comes, is touched, and goes.
  void PlayAMatch() {
    Make(2);
    Join();
    ASSERT_TRUE(client->Record(file).ok());
    EXPECT_TRUE(client->recording());
    Play();
    for (int step = 1; step <= 90; ++step) {
      // At step 25 a game puts it a metre further.
      const bool jumped = step >= 25;
      const double x = -6 + step * 0.1331 + (jumped ? 1 : 0);
      const bool east = x > 0;
      const replication::BodyTraits traits{.jumps = static_cast<std::uint8_t>(jumped ? 1 : 0), .tuning = {}};
      const std::vector<replication::BodyRecord> ball = {{kBall, Epoch(east ? 2 : 1), Moving(x, 4), nullptr, traits}};
      std::vector<replication::BodyRecord> west_has = east ? std::vector<replication::BodyRecord>() : ball;
      if (step >= 20 && step < 60) west_has.push_back({BodyId(2), Epoch(1), Moving(-20, 0)});
      std::vector<replication::DepartureRecord> leaves;
      if (east && west_had) leaves.push_back({kBall, Epoch(1), RegionId(2)});
      if (step == 60) leaves.push_back({BodyId(2), Epoch(1), RegionId()});
      west_had = !east;
      Advance([&](Tick t) {
        instance->regions[0]->Snapshot(t, west_has, leaves);
        instance->regions[1]->Snapshot(t, east ? ball : std::vector<replication::BodyRecord>());
      });
      if (step == 30) Touch(true);
      if (step == 40) Touch(false);
      for (int more = 0; more < 5; ++more) PollOnce();  // both regions' datagrams are in
      Look();
    }
    EXPECT_TRUE(client->StopRecording().ok());
    EXPECT_FALSE(client->recording());
  }
  void Touch(bool begin) {
    const auto kind = begin ? ClientEvent::Kind::kContactBegan : ClientEvent::Kind::kContactEnded;
    instance->regions[0]->TellPairs(tick, {{kBall, BodyId(2), false, begin}});
    ASSERT_TRUE(Until([&] { return Count(kind) == 1; }));
  }

  RecordingHeader Header() const {
    return {.instance_id = "x",
            .player = PlayerNumber(1),
            .tick_rate_hz = 60,
            .snapshot_rate_hz = 30,
            .started = true,
            .map = WrittenMap(instance->map),
            .scene = instance->packed_scene()};
  }

  // Twenty seconds of two regions, in which bodies come, rest, change their properties, cross and go, and the second
  // region is lost after eight seconds and begins again after twelve. The world's own properties change, too.
  void RecordTwentySeconds(std::uint64_t max_bytes = 1 << 20) {
    auto writer = RecordingWriter::Create(file, Header(), max_bytes);
    ASSERT_TRUE(writer.ok()) << writer.status();
    Recorder recorder(*std::move(writer), *instance->scene, Header());
    const TimePoint begin = now;
    bool full = false;
    for (int step = 0; step < 600 && !full; ++step) {
      const TimePoint at = begin + step * std::chrono::microseconds(33'333);
      if (step == 0 || step == 360) recorder.Region(at, RegionId(2), RegionEntry::Change::kBegins);
      if (step == 0) recorder.Region(at, RegionId(1), RegionEntry::Change::kBegins);
      if (step == 240) recorder.Region(at, RegionId(2), RegionEntry::Change::kLost);
      if (step % 30 == 0) recorder.Note(at, "second " + std::to_string(step / 30));
      if (step == 0) recorder.World(at, World(1, "waiting"));
      if (step == 180) recorder.World(at, World(2, "play"));
      if (step == 187) recorder.World(at, World(3, "play"));
      if (step == 420) recorder.World(at, {});  // as the scene gives them
      replication::ReceivedSnapshot west, east;
      west.tick = east.tick = Tick(static_cast<std::uint64_t>(2 * step + 10));
      const bool crossed = step >= 450;
      (crossed ? east : west).bodies.push_back({kBall, Epoch(crossed ? 2 : 1), Moving(-6 + step * 0.02, 4)});
      if (step == 450) west.departures.push_back({kBall, Epoch(1), RegionId(2)});
      if (step < 2) west.bodies.push_back({BodyId(2), Epoch(1), Moving(-20, 0), Properties(7)});  // never said again
      if (step == 400) west.bodies.push_back({BodyId(2), Epoch(1), Moving(-20, 0), Properties(9)});
      if (step > 100 && step < 200) east.bodies.push_back({BodyId(3), Epoch(1), Moving(12, 1)});
      if (step == 200) east.departures.push_back({BodyId(3), Epoch(1), RegionId()});
      recorder.Snapshot(at, RegionId(1), west);
      if (step < 240 || step >= 360) recorder.Snapshot(at, RegionId(2), east);
      full = !recorder.Flush(at).ok();
    }
    (void)recorder.Close();
  }
  static std::shared_ptr<const replication::Bytes> Properties(std::uint8_t value) {
    return std::make_shared<const replication::Bytes>(replication::Bytes{value, 1, 2});
  }

  replication::Bytes World(std::int64_t goals, const char* phase) const {
    const std::vector<PropertyDef>& defs = instance->scene->instance_properties;
    PropertySet set;
    EXPECT_TRUE(set.Set(defs, "goals", goals).ok() && set.Set(defs, "phase", std::string(phase)).ok());
    return set.Encode();
  }
  static std::int64_t Goals(const Client& of) { return std::get<std::int64_t>(*of.WorldPropertyOf("goals")); }

  // Describes all bodies that a client knows, in a line each, and the world.
  static std::string Known(const Client& of) {
    std::ostringstream out;
    for (const auto& [id, body] : of.World()) {
      out << id.value() << ": region " << body.region.value() << " epoch " << body.epoch.value() << " x "
          << body.state.position.x << " property " << (body.properties ? int(body.properties->front()) : -1) << "\n";
    }
    for (const RegionStats& region : of.Stats().regions) out << region.region.value() << region.connected << "\n";
    out << of.map().version() << " " << int(of.state()) << "\n";
    out << "goals " << Goals(of) << " phase " << PropertyText(*of.WorldPropertyOf("phase")) << "\n";
    return out.str();
  }

  std::string file;
  std::vector<RecordedFrame> seen;
  bool west_had = false;
};

}  // namespace tessera::client
