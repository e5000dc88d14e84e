// A recording plays back as it was, and a file that is incomplete is refused.
#include "client_sdk/recording.h"

#include <gmock/gmock.h>

#include <fstream>

#include "client_sdk/file_path.h"
#include "client_sdk/recording_fixture.h"
#include "client_sdk/replay.h"
#include "core/replication/codec/checksum.h"

namespace tessera::client {
namespace {

using replication::BodyRecord;
using replication::DepartureRecord;
using testing::HasSubstr;

std::string Read(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void Write(const std::string& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

bool SameEvent(const ClientEvent& a, const ClientEvent& b) {
  return a.kind == b.kind && a.body == b.body && a.other == b.other && a.region == b.region && a.detail == b.detail;
}

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
  for (const RecordedFrame& then : seen) {
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

TEST_F(RecordingTest, HoldsTheCorrectionsOfThePredictionWithTheirCause) {
  Make(1);
  JoinOptions options = Options();
  options.predict = true;
  auto joined = Client::Join(options);
  ASSERT_TRUE(joined.ok()) << joined.status();
  client = *std::move(joined);
  ASSERT_TRUE(client->Record(file).ok());
  Play();
  for (int step = 1; step <= 30; ++step) {
    client->Move({1, 0, 0}, {});
    const std::vector<BodyRecord> own = {{client->own_body(), Epoch(1), Moving(step < 25 ? 3 : 3.5, 1)}};
    Advance([&](Tick at) { instance->regions[0]->Snapshot(at, own); });
    (void)client->Interpolated(now);
  }
  constexpr auto kKind = ClientEvent::Kind::kPredictionCorrected;
  ASSERT_GE(Count(kKind), 1);
  const ClientEvent live = *Find(kKind);
  const int count = Count(kKind);
  EXPECT_EQ(live.body, client->own_body());
  EXPECT_EQ(live.region, RegionId(1));
  EXPECT_THAT(live.detail, HasSubstr(" m: "));
  EXPECT_EQ(client->Stats().corrections, static_cast<std::uint64_t>(count));
  ASSERT_TRUE(client->StopRecording().ok());

  auto playing = Client::Play(file);
  ASSERT_TRUE(playing.ok()) << playing.status();
  client = *std::move(playing);
  events.clear();
  for (ClientEvent& event : client->Poll(now)) events.push_back(std::move(event));
  for (ClientEvent& event : client->Poll(now + std::chrono::minutes(1))) events.push_back(std::move(event));
  ASSERT_EQ(Count(kKind), count);
  EXPECT_TRUE(SameEvent(*Find(kKind), live));
}

// A recording that begins in the middle has bodies at rest as well, though nobody sends them any more.
TEST_F(RecordingTest, BeginsInTheMiddle) {
  Make(1);
  Join();
  Play();
  BodyState rests = Moving(3, 0);
  rests.asleep = true;
  instance->regions[0]->TellWorld(1, 20, World(3, "play"));
  ASSERT_TRUE(Until([&] { return Goals(*client) == 3; }));
  for (int step = 1; step <= 40; ++step) {
    const std::vector<BodyRecord> bodies = {{kBall, Epoch(1), rests}, {BodyId(2), Epoch(1), Moving(0.1 * step, 6)}};
    Advance([&](Tick t) { instance->regions[0]->Snapshot(t, bodies); });
    if (step != 20) continue;
    ASSERT_TRUE(client->Record(file).ok());
    EXPECT_FALSE(client->Record(file).ok());  // one at a time
  }
  instance->regions[0]->TellWorld(1, 30, World(4, "play"));
  ASSERT_TRUE(Until([&] { return Goals(*client) == 4; }));
  client.reset();  // ends the file, too
  auto playing = Client::Play(file);
  ASSERT_TRUE(playing.ok()) << playing.status();
  EXPECT_EQ((*playing)->state(), ClientState::kPlaying);
  (*playing)->Poll(now);
  EXPECT_EQ(Goals(**playing), 3) << "that stood when it began";
  (*playing)->Poll(now + *(*playing)->length());
  ASSERT_EQ((*playing)->World().size(), 2u);
  EXPECT_EQ(Goals(**playing), 4);
  EXPECT_TRUE((*playing)->World().at(kBall).state.asleep);
  EXPECT_NEAR((*playing)->World().at(kBall).state.position.x, 3, 1e-3);
}

TEST_F(RecordingTest, LateAndDoubledNewsAreAllThereInTheEnd) {
  Make(1);
  auto writer = RecordingWriter::Create(file, Header(), 1 << 20);
  ASSERT_TRUE(writer.ok()) << writer.status();
  Recorder recorder(*std::move(writer), *instance->scene, Header());
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

TEST_F(RecordingTest, FromAnyPlaceItGoesOnAsIfPlayedFromTheBeginning) {
  Make(2);
  ASSERT_NO_FATAL_FAILURE(RecordTwentySeconds());
  auto sought = Client::Play(file);
  ASSERT_TRUE(sought.ok()) << sought.status();
  ASSERT_GT((*sought)->length(), std::chrono::seconds(19));
  TimePoint then = now;
  // There and back, and beyond the end.
  for (const double place_s : {0.0, 4.9, 7.7, 5.3, 9.0, 11.0, 13.0, 19.0, 25.0, 2.0, 18.0, 19.5}) {
    SCOPED_TRACE(place_s);
    const auto place = std::min(std::chrono::microseconds(static_cast<int>(place_s * 1e6)), *(*sought)->length());
    auto played = Client::Play(file);
    ASSERT_TRUE(played.ok());
    for (auto at = std::chrono::microseconds(0); at < place; at += std::chrono::milliseconds(20)) {
      (*played)->Poll(now + at);
      (void)(*played)->Interpolated(now + at);
    }
    (*played)->Poll(now + place);
    (void)(*played)->Interpolated(now + place);
    then += std::chrono::hours(1);
    const std::size_t known = (*sought)->World().size();
    ASSERT_TRUE((*sought)->Seek(place).ok());
    std::size_t vanished = 0;
    for (const ClientEvent& event : (*sought)->Poll(then)) vanished += event.kind == ClientEvent::Kind::kVanished;
    EXPECT_GE(vanished, known);
    EXPECT_EQ(Known(**sought), Known(**played));
    (void)(*sought)->Interpolated(then);
    for (int step = 1; step <= 50 && (*played)->state() != ClientState::kEnded; ++step) {
      const auto on = std::chrono::milliseconds(20 * step);
      (*played)->Poll(now + place + on);
      (*sought)->Poll(then + on);
      const auto a = (*sought)->Interpolated(then + on), b = (*played)->Interpolated(now + place + on);
      ASSERT_EQ(a.size(), b.size());
      for (std::size_t i = 0; i < a.size(); ++i) {
        EXPECT_EQ(a[i].id, b[i].id);
        EXPECT_LT(Length(a[i].pose.position - b[i].pose.position), 0.05) << a[i].id.value();
      }
    }
    EXPECT_EQ(Known(**sought), Known(**played));
  }
  EXPECT_EQ(client, nullptr);
}

TEST_F(RecordingTest, TheWorldsPropertiesAreThoseOfTheMoment) {
  Make(2);
  ASSERT_NO_FATAL_FAILURE(RecordTwentySeconds());
  auto playing = Client::Play(file);
  ASSERT_TRUE(playing.ok()) << playing.status();
  client = *std::move(playing);
  const auto told = [&](TimePoint at) {
    int count = 0;
    for (const ClientEvent& event : client->Poll(at)) {
      count += event.kind == ClientEvent::Kind::kWorldPropertyChanged && event.property == "goals";
    }
    return count;
  };
  EXPECT_EQ(told(now), 1);
  EXPECT_EQ(Goals(*client), 1);
  EXPECT_EQ(told(now + std::chrono::seconds(5)), 0);
  EXPECT_EQ(told(now + std::chrono::seconds(10)), 2) << "live, each change is told";
  EXPECT_EQ(Goals(*client), 3);
  EXPECT_EQ(client->WorldPropertyOf("phase"), PropertyValue(std::string("play")));
  const auto seek = [&](double place_s) {
    ASSERT_TRUE(client->Seek(std::chrono::microseconds(static_cast<int>(place_s * 1e6))).ok());
    EXPECT_EQ(told(now), 1) << place_s;
  };
  seek(1);
  EXPECT_EQ(Goals(*client), 1) << "as it was then";
  seek(6.5);
  EXPECT_EQ(Goals(*client), 3) << "both changes are since the key, and told once";
  seek(13);
  EXPECT_EQ(Goals(*client), 3) << "by the key before it";
  seek(19);
  EXPECT_EQ(Goals(*client), 0);
  EXPECT_EQ(client->WorldPropertyOf("phase"), PropertyValue(std::string("waiting")));
}

TEST_F(RecordingTest, MalformedPropertiesOfTheWorldEndThePlaying) {
  Make(1);
  auto writer = RecordingWriter::Create(file, Header(), 1 << 20);
  ASSERT_TRUE(writer.ok()) << writer.status();
  Recorder recorder(*std::move(writer), *instance->scene, Header());
  recorder.World(now, {1, 2, 3});
  ASSERT_TRUE(recorder.Close().ok());
  auto playing = Client::Play(file);
  ASSERT_TRUE(playing.ok()) << playing.status();
  (*playing)->Poll(now);
  EXPECT_EQ((*playing)->reason().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string((*playing)->reason().message()), HasSubstr("world: "));
}

TEST_F(RecordingTest, ASummaryNeedsOnlyItsEnds) {
  Make(2);
  ASSERT_NO_FATAL_FAILURE(RecordTwentySeconds());
  auto summary = SummaryOf(file);
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(summary->instance_id, "x");
  EXPECT_EQ(summary->length, (*Client::Play(file))->length());
  const std::string whole = Read(file);
  Write(file, whole.substr(0, whole.size() - 1));
  summary = SummaryOf(file);
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(summary->length, std::nullopt);
  for (std::size_t size = 0; size < 40; ++size) {
    Write(file, whole.substr(0, size));
    summary = SummaryOf(file);
    EXPECT_TRUE(!summary.ok() || !summary->length) << size;
  }
  Write(file, std::string(10'000, 'x'));
  EXPECT_EQ(SummaryOf(file).status().code(), absl::StatusCode::kInvalidArgument);
  std::remove(file.c_str());
  EXPECT_EQ(SummaryOf(file).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(RecordingTest, AFileMayHaveAnyName) {
  std::remove(file.c_str());
  file = testing::TempDir() + "\u043c\u0430\u0442\u0447 " + std::to_string(::getpid()) + ".tsr";
  Make(2);
  ASSERT_NO_FATAL_FAILURE(RecordTwentySeconds());
  EXPECT_TRUE(SummaryOf(file).ok());
  EXPECT_FALSE(Read(file).empty()) << "it has that name for others, too";
  for (const std::string& name : {std::string("a/b.tsr"), file, std::string("no UTF-8: \xff")}) {
    EXPECT_EQ(TextOf(FilePath(name)), name);
  }
}

TEST_F(RecordingTest, NotesComeAtTheirTime) {
  Make(2);
  ASSERT_NO_FATAL_FAILURE(RecordTwentySeconds());
  auto playing = Client::Play(file);
  ASSERT_TRUE(playing.ok()) << playing.status();
  (*playing)->Poll(now);
  EXPECT_THAT((*playing)->TakeNotes(), testing::ElementsAre("second 0"));
  (*playing)->Poll(now + std::chrono::milliseconds(2500));
  EXPECT_THAT((*playing)->TakeNotes(), testing::ElementsAre("second 1", "second 2"));
  EXPECT_TRUE((*playing)->TakeNotes().empty());
  ASSERT_TRUE((*playing)->Seek(std::chrono::milliseconds(12'500)).ok());
  (*playing)->Poll(now);
  EXPECT_THAT((*playing)->TakeNotes(), testing::ElementsAre("second 11", "second 12")) << "since the last key";
  EXPECT_EQ((*playing)->Note("x").code(), absl::StatusCode::kOk) << "nobody records: nothing is written";
  EXPECT_EQ((*playing)->Note(std::string(2 << 20, 'x')).code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(RecordingTest, FilesOfOtherFormatsAreRefusedByTheirFormat) {
  ASSERT_NO_FATAL_FAILURE(PlayAMatch());
  EXPECT_EQ(client->Seek(std::chrono::seconds(1)).code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(client->length(), std::nullopt);
  std::string bytes = Read(file);
  ASSERT_EQ(bytes[4], 4);
  for (const int other : {2, 5}) {
    bytes[4] = static_cast<char>(other);
    Write(file, bytes);
    EXPECT_THAT(std::string(Client::Play(file).status().message()),
                HasSubstr("has format " + std::to_string(other) + ", this library reads 3 to 4"));
  }
  bytes[4] = 3;  // as it was before the world's properties were in it
  Write(file, bytes);
  auto older = Client::Play(file);
  ASSERT_TRUE(older.ok()) << older.status();
  (*older)->Poll(now);
  (*older)->Poll(now + std::chrono::milliseconds(500));
  EXPECT_EQ((*older)->World().size(), 1u);
  EXPECT_EQ(SummaryOf(file)->length, (*older)->length());
}

// A key of which frames are missing because the file was full is none.
TEST_F(RecordingTest, WhereverAFileWasFullItsEndCanBeSought) {
  Make(2);
  ASSERT_NO_FATAL_FAILURE(RecordTwentySeconds());
  const std::size_t whole = Read(file).size();
  for (std::uint64_t max = whole / 8; max < whole; max += whole / 23) {
    SCOPED_TRACE(max);
    ASSERT_NO_FATAL_FAILURE(RecordTwentySeconds(max));
    auto sought = Client::Play(file), played = Client::Play(file);
    ASSERT_TRUE(sought.ok() && played.ok()) << sought.status();
    const std::chrono::microseconds length = *(*sought)->length();
    ASSERT_TRUE((*sought)->Seek(length).ok());
    (*sought)->Poll(now);
    (*played)->Poll(now);
    (*played)->Poll(now + length);
    EXPECT_EQ(Known(**sought), Known(**played));
  }
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
