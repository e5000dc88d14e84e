// A recording plays back as it was, and a file that is incomplete is refused.
#include "client_sdk/recording.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <sstream>

#include "client_sdk/client_fixture.h"
#include "client_sdk/recorder.h"
#include "client_sdk/replay.h"
#include "core/replication/codec/checksum.h"

namespace tessera::client {
namespace {

using replication::BodyRecord;
using replication::DepartureRecord;
using testing::HasSubstr;

std::string FileOf(const std::string& name) { return testing::TempDir() + name; }

std::string Read(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void Write(const std::string& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

// The bodies that a game sees in a frame, and the number of events up to it.
struct Seen {
  TimePoint time;
  std::vector<ShownBody> bodies;
  std::size_t events = 0;
};

bool SameEvent(const ClientEvent& a, const ClientEvent& b) {
  return a.kind == b.kind && a.body == b.body && a.other == b.other && a.region == b.region && a.detail == b.detail;
}

class RecordingTest : public ClientFixture {
 protected:
  void SetUp() override { file = FileOf("recording_test_" + std::to_string(::getpid()) + ".tsr"); }
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
      const std::vector<BodyRecord> ball = {{kBall, Epoch(east ? 2 : 1), Moving(x, 4), nullptr, traits}};
      std::vector<BodyRecord> west_has = east ? std::vector<BodyRecord>() : ball;
      if (step >= 20 && step < 60) west_has.push_back({BodyId(2), Epoch(1), Moving(-20, 0)});
      std::vector<DepartureRecord> leaves;
      if (east && west_had) leaves.push_back({kBall, Epoch(1), RegionId(2)});
      if (step == 60) leaves.push_back({BodyId(2), Epoch(1), RegionId()});
      west_had = !east;
      Advance([&](Tick t) {
        instance->regions[0]->Snapshot(t, west_has, leaves);
        instance->regions[1]->Snapshot(t, east ? ball : std::vector<BodyRecord>());
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

  std::string file;
  std::vector<Seen> seen;
  bool west_had = false;
};

TEST_F(RecordingTest, PlaysTheSamePosesAndEvents) {
  ASSERT_NO_FATAL_FAILURE(PlayAMatch());
  const std::unique_ptr<Client> live = std::move(client);
  auto playing = Client::Play(file);
  ASSERT_TRUE(playing.ok()) << playing.status();
  client = *std::move(playing);
  EXPECT_EQ(client->player(), live->player());
  EXPECT_EQ(client->scene().name, live->scene().name);
  EXPECT_EQ(client->map().version(), live->map().version());
  EXPECT_TRUE(client->return_token().empty());
  EXPECT_EQ(client->state(), ClientState::kWaiting);

  std::vector<ClientEvent> told;
  const auto poll = [&](TimePoint t) {
    for (ClientEvent& event : client->Poll(t)) told.push_back(std::move(event));
  };
  poll(TimePoint(std::chrono::hours(1)));  // when the recording began
  std::size_t bodies = 0;
  for (const Seen& then : seen) {
    poll(then.time);
    const std::vector<ShownBody> shown = client->Interpolated(then.time);
    ASSERT_EQ(shown.size(), then.bodies.size());
    ASSERT_EQ(told.size(), then.events);
    for (std::size_t i = 0; i < shown.size(); ++i) {
      EXPECT_EQ(shown[i].id, then.bodies[i].id);
      EXPECT_LT(Length(shown[i].pose.position - then.bodies[i].pose.position), 1e-5);  // a microsecond's way
      ++bodies;
    }
  }
  EXPECT_GT(bodies, 100u);
  EXPECT_EQ(client->state(), ClientState::kPlaying);
  EXPECT_EQ(client->World().at(kBall).region, RegionId(2));
  ASSERT_EQ(told.size(), events.size());
  for (std::size_t i = 0; i < told.size(); ++i) {
    EXPECT_TRUE(SameEvent(told[i], events[i])) << i << " kinds " << int(told[i].kind) << " " << int(events[i].kind);
  }
  poll(seen.back().time + std::chrono::seconds(1));
  EXPECT_EQ(client->state(), ClientState::kEnded);
  EXPECT_TRUE(client->reason().ok());
  EXPECT_EQ(told.back().kind, ClientEvent::Kind::kEnded);
}

// A recording that begins in the middle has bodies at rest as well, though nobody sends them any more.
TEST_F(RecordingTest, BeginsInTheMiddle) {
  Make(1);
  Join();
  Play();
  BodyState rests = Moving(3, 0);
  rests.asleep = true;
  for (int step = 1; step <= 40; ++step) {
    const std::vector<BodyRecord> bodies = {{kBall, Epoch(1), rests}, {BodyId(2), Epoch(1), Moving(0.1 * step, 6)}};
    Advance([&](Tick t) { instance->regions[0]->Snapshot(t, bodies); });
    if (step != 20) continue;
    ASSERT_TRUE(client->Record(file).ok());
    EXPECT_FALSE(client->Record(file).ok());  // one at a time
  }
  client.reset();  // ends the file, too
  auto playing = Client::Play(file);
  ASSERT_TRUE(playing.ok()) << playing.status();
  EXPECT_EQ((*playing)->state(), ClientState::kPlaying);
  (*playing)->Poll(now);
  (*playing)->Poll(now + std::chrono::milliseconds(300));
  ASSERT_EQ((*playing)->World().size(), 2u);
  EXPECT_TRUE((*playing)->World().at(kBall).state.asleep);
  EXPECT_NEAR((*playing)->World().at(kBall).state.position.x, 3, 1e-3);
}

TEST_F(RecordingTest, LateAndDoubledNewsAreAllThereInTheEnd) {
  Make(1);
  auto writer = RecordingWriter::Create(file,
                                        {.instance_id = "x",
                                         .player = PlayerNumber(1),
                                         .tick_rate_hz = 60,
                                         .snapshot_rate_hz = 30,
                                         .started = true,
                                         .map = ToProto(instance->map).SerializeAsString(),
                                         .scene = instance->written_scene()},
                                        1 << 20);
  ASSERT_TRUE(writer.ok()) << writer.status();
  Recorder recorder(*std::move(writer), *instance->scene);
  const auto told = [&](std::uint64_t t, std::vector<BodyRecord> bodies, std::vector<DepartureRecord> gone = {}) {
    replication::ReceivedSnapshot snapshot;
    snapshot.tick = Tick(t);
    snapshot.bodies = std::move(bodies);
    snapshot.departures = std::move(gone);
    recorder.Snapshot(now, RegionId(1), snapshot);
    ASSERT_TRUE(recorder.Flush(now).ok());
    now += std::chrono::milliseconds(30);
  };
  recorder.Region(now, RegionId(1), RegionEntry::Change::kBegins);
  const BodyId kNeverAgain{3}, kLeft{4};
  told(12, {{kBall, Epoch(1), Moving(1, 0)}});
  told(10, {{kBall, Epoch(1), Moving(9, 0)}, {kLeft, Epoch(1), Moving(5, 0)}});  // overtaken
  told(14, {{kBall, Epoch(1), Moving(2, 0)}}, {{kLeft, Epoch(1), RegionId()}});
  now += 2 * Recorder::kHold;
  told(16, {});
  told(11, {{kBall, Epoch(1), Moving(7, 0)}, {kNeverAgain, Epoch(1), Moving(6, 0)}, {kLeft, Epoch(1), Moving(8, 0)}});
  ASSERT_TRUE(recorder.Close().ok());

  auto playing = Client::Play(file);
  ASSERT_TRUE(playing.ok()) << playing.status();
  (*playing)->Poll(now);
  (*playing)->Poll(now + std::chrono::seconds(1));
  const auto& world = (*playing)->World();
  ASSERT_EQ(world.size(), 2u);
  EXPECT_NEAR(world.at(kBall).state.position.x, 2, 1e-3);
  EXPECT_NEAR(world.at(kNeverAgain).state.position.x, 6, 1e-3);
}

TEST_F(RecordingTest, EveryFileThatIsNotWholeIsRefusedByName) {
  ASSERT_NO_FATAL_FAILURE(PlayAMatch());
  const std::string whole = Read(file);
  ASSERT_GT(whole.size(), 1000u);
  for (std::size_t size = 0; size < whole.size(); size += size < 64 ? 1 : 37) {
    Write(file, whole.substr(0, size));
    const auto cut = Client::Play(file);
    ASSERT_FALSE(cut.ok()) << size;
    EXPECT_THAT(std::string(cut.status().message()), HasSubstr(file));
    EXPECT_EQ(cut.status().code(), size < 8 ? absl::StatusCode::kInvalidArgument : absl::StatusCode::kDataLoss);
  }
  for (std::size_t at = 0; at < whole.size(); at += at < 64 ? 1 : 41) {
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ (1 << (at % 8)));
    Write(file, flipped);
    const auto damaged = Client::Play(file);
    ASSERT_FALSE(damaged.ok()) << at;
    EXPECT_THAT(std::string(damaged.status().message()), HasSubstr(file));
  }
  Write(file, whole + "x");
  EXPECT_EQ(Client::Play(file).status().code(), absl::StatusCode::kDataLoss);
  Write(file, "");
  EXPECT_EQ(Client::Play(file).status().code(), absl::StatusCode::kInvalidArgument);
  std::remove(file.c_str());
  EXPECT_EQ(Client::Play(file).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(RecordingTest, AFullFileEndsTheRecordingAndIsWhole) {
  Make(1);
  Join();
  constexpr std::uint64_t kMax = 3000;
  ASSERT_TRUE(client->Record(file, kMax).ok());
  Play();
  for (int step = 1; step <= 400 && Count(ClientEvent::Kind::kRecordingEnded) == 0; ++step) {
    const std::vector<BodyRecord> bodies = {{kBall, Epoch(1), Moving(0.01 * step * step, 6)}};
    Advance([&](Tick t) { instance->regions[0]->Snapshot(t, bodies); });
  }
  ASSERT_EQ(Count(ClientEvent::Kind::kRecordingEnded), 1);
  EXPECT_THAT(Find(ClientEvent::Kind::kRecordingEnded)->detail, HasSubstr("full"));
  EXPECT_FALSE(client->recording());
  EXPECT_EQ(client->state(), ClientState::kPlaying);
  EXPECT_LE(Read(file).size(), kMax);
  EXPECT_GT(Read(file).size(), kMax - 200);
  auto playing = Client::Play(file);
  ASSERT_TRUE(playing.ok()) << playing.status();
  (*playing)->Poll(now);
  (*playing)->Poll(now + std::chrono::seconds(1));
  EXPECT_EQ((*playing)->World().size(), 1u);
  EXPECT_FALSE(client->Record("/no/such/folder/x.tsr").ok());
  EXPECT_FALSE(client->Record(file, 100).ok());  // not even the scene fits
}

}  // namespace
}  // namespace tessera::client
