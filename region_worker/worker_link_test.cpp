// The link between regions: this test is the neighbour, with a region of its own, of a worker that is the real program.
#include <gmock/gmock.h>

#include <deque>
#include <optional>

#include "core/region/region.h"
#include "core/region/rules.h"
#include "core/world/byte_view.h"
#include "net/endpoint.h"
#include "net/protocol.h"
#include "net/testing/test_identity.h"
#include "region_worker/core/link_message.h"
#include "region_worker/input_files.h"
#include "region_worker/standalone.h"
#include "region_worker/testing/worker_process.h"
#include "tessera/v1/game.pb.h"

namespace tessera::worker {
namespace {

using Clock = std::chrono::steady_clock;

constexpr char kScene[] = R"(
  name: "two-halves"
  bounds { min { x: -10 y: -2 z: -10 } max { x: 10 y: 10 z: 10 } }
  bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
  bodies { id: 2 mass: 1 shape { sphere { radius: 0.5 } } pose { position { x: -0.3 y: 0.5 } } linear_velocity { x: 2 } }
  bodies { id: 3 mass: 1 shape { sphere { radius: 0.5 } } pose { position { x: 5 y: 0.5 } } }
)";

// More awake bodies along the border at x = 0 than one message of the default size holds. They float and never meet.
constexpr char kCrowd[] = R"(
  name: "crowd"
  bounds { min { x: -10 y: -10 z: -10 } max { x: 10 y: 200 z: 10 } }
  gravity { x: 0 y: 0 z: 0 }
  scatters {
    first_id: 1 count: 14000
    area { min { x: -0.8 y: 0 z: -9 } max { x: 0.8 y: 180 z: 9 } }
    spacing: 0.4
    templates { mass: 1 linear_velocity { y: 0.1 } never_sleeps: true shape { sphere { radius: 0.1 } } }
  }
)";

v1::LinkHello HelloOf(std::uint32_t region) {
  v1::LinkHello hello;
  hello.set_region(region);
  hello.set_incarnation(region);
  hello.set_map_version(1);
  hello.set_rules(region::RulesOf(region::RegionSettings()));
  return hello;
}

net::EndpointIdentity IdentityOf(std::uint32_t region, const net::SigningKey& key) {
  return net::TestWorker(key, kStandaloneInstanceId, RegionId(region), Incarnation(region), true);
}

net::Credentials PassOf(std::uint32_t region, const net::SigningKey& key) {
  return net::CredentialsOf(IdentityOf(region, key));
}

std::unique_ptr<net::Endpoint> EndpointAt(std::uint16_t port) {
  auto endpoint =
      net::Endpoint::Create({.bind_address = "127.0.0.1", .port = port, .max_message_bytes = net::kMaxFrameBytes});
  EXPECT_TRUE(endpoint.ok()) << endpoint.status();
  return *std::move(endpoint);
}

// One end of a link, and what came over it.
struct LinkLine {
  explicit LinkLine(std::uint16_t port) : endpoint(EndpointAt(port)) {}

  void Send(std::span<const std::uint8_t> bytes) {
    EXPECT_TRUE(endpoint->Send(peer, net::Delivery::kReliable, bytes).ok());
  }
  void SendHello(const v1::LinkHello& hello) {
    const std::string text = hello.SerializeAsString();
    Send(AsBytes(text));
  }
  bool Until(const std::function<bool()>& done) {
    for (const auto limit = Clock::now() + kPatience; Clock::now() < limit;) {
      if (done()) return true;
      for (net::Event& event : endpoint->Service(std::chrono::milliseconds(2))) {
        if (event.kind == net::Event::Kind::kConnected) peer = event.peer;
        if (event.refusal) refusal = event.refusal;
        if (event.peer != peer) continue;
        connected = event.kind != net::Event::Kind::kDisconnected;
        if (event.kind == net::Event::Kind::kMessage) messages.push_back(std::move(event.bytes));
      }
    }
    return done();
  }
  std::optional<v1::LinkHello> TakeHello() {
    v1::LinkHello hello;
    if (!Until([&] { return !messages.empty(); })) return std::nullopt;
    const net::Bytes bytes = std::move(messages.front());
    messages.pop_front();
    if (!hello.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return std::nullopt;
    return hello;
  }

  std::unique_ptr<net::Endpoint> endpoint;
  net::PeerHandle peer;
  bool connected = false;
  std::optional<net::Refusal> refusal;
  std::deque<net::Bytes> messages;
};

class WorkerLinkTest : public testing::Test {
 protected:
  explicit WorkerLinkTest(const char* scene = kScene) : scene_file_(WriteTestFile("link.textproto", scene)) {}
  // The worker is `region` of two; this test is the other one.
  void StartWorker(std::uint32_t region) {
    worker_ = std::make_unique<WorkerProcess>(std::vector<std::string>{"--scene", scene_file_, "--regions", "2",
                                                                       "--region", std::to_string(region),
                                                                       "--base-port", std::to_string(base_)});
    ASSERT_TRUE(worker_->WaitForLine("listening")) << worker_->said();
  }
  std::uint16_t LinkPort(std::uint32_t region) const {
    return static_cast<std::uint16_t>(base_ + 3 * (region - 1) + 1);
  }
  std::string MetricsOf(std::uint32_t region) const {
    return ReadMetrics(static_cast<std::uint16_t>(LinkPort(region) + 1));
  }

  std::uint16_t base_ = FreeBasePort(2);
  std::string scene_file_;
  std::unique_ptr<WorkerProcess> worker_;
};

// Region 2 with a worker as region 1, which dials.
class NeighborTest : public WorkerLinkTest {
 protected:
  explicit NeighborTest(const char* scene = kScene) : WorkerLinkTest(scene), line_(LinkPort(2)) {
    line_.endpoint->Open(IdentityOf(2, StandaloneKey()));
    scene_ = *LoadSceneFile(scene_file_);
    region_.emplace(region::Config{.self = RegionId(2),
                                   .incarnation = Incarnation(2),
                                   .scene = scene_,
                                   .map = *MakeGridMap(scene_->ground(), 2),
                                   .settings = {}});
    Keep(region_->Start());
    StartWorker(1);
  }
  void Keep(std::vector<region::OutgoingFrame> frames) {
    for (region::OutgoingFrame& frame : frames) kept_.push_back(std::move(frame.bytes));
    while (kept_.size() > 2) kept_.pop_front();
  }
  // Answers a dial; sends what the worker may not have.
  void Link() {
    line_.messages.clear();
    ASSERT_TRUE(line_.Until([&] { return line_.connected; }));
    const std::optional<v1::LinkHello> hello = line_.TakeHello();
    ASSERT_TRUE(hello.has_value());
    EXPECT_EQ(hello->SerializeAsString(), HelloOf(1).SerializeAsString());
    line_.SendHello(HelloOf(2));
    for (const net::Bytes& frame : kept_) line_.Send(frame);
  }
  // In step with the worker up to tick `to`.
  bool StepTo(Tick to) {
    return line_.Until([&] {
      for (; !line_.messages.empty(); line_.messages.pop_front()) {
        if (ReadLinkMessage(line_.messages.front())->kind != LinkMessageKind::kFrame) continue;
        const absl::Status status = region_->Receive(RegionId(1), line_.messages.front());
        EXPECT_TRUE(status.ok() || status.message().substr(0, 8) == "old tick") << status;
      }
      while (region_->CanStep() && region_->tick() < to) {
        region::StepResult result = region_->Step();
        handed_in_ += result.handed_in;
        for (const region::OutgoingFrame& frame : result.frames) line_.Send(frame.bytes);
        Keep(std::move(result.frames));
      }
      return region_->tick() >= to;
    });
  }

  std::shared_ptr<const Scene> scene_;
  std::optional<region::Region> region_;
  LinkLine line_;
  std::deque<net::Bytes> kept_;
  std::uint32_t handed_in_ = 0;
};

TEST_F(NeighborTest, StepsTogetherAndHandsBodiesOver) {
  Link();
  ASSERT_TRUE(StepTo(Tick(90)));
  EXPECT_EQ(handed_in_, 1u);  // body 2 rolled over
  EXPECT_EQ(region_->owned().size(), 2u);
  EXPECT_TRUE(region_->Owns(BodyId(2)));
}

TEST_F(NeighborTest, GoesOnWhereItWasWhenALinkBreaks) {
  Link();
  ASSERT_TRUE(StepTo(Tick(20)));
  for (int round = 1; round <= 3; ++round) {
    line_.endpoint->Disconnect(line_.peer);
    line_.connected = false;
    Link();
    ASSERT_TRUE(StepTo(Tick(20 + 10 * static_cast<std::uint64_t>(round))));
  }
  EXPECT_TRUE(worker_->WaitForLine("link lost region=2"));
}

TEST_F(NeighborTest, FramesThatAreNoneAreCountedAndHarmNothing) {
  Link();
  ASSERT_TRUE(StepTo(Tick(10)));
  line_.Send(std::vector<std::uint8_t>{});
  line_.Send(std::vector<std::uint8_t>(500, 0xff));
  net::Bytes cut = kept_.back();
  cut.resize(cut.size() / 2);
  line_.Send(cut);
  ASSERT_TRUE(StepTo(Tick(30)));
  ASSERT_TRUE(worker_->WaitForLine("frame dropped from=2"));
  const std::string metrics = MetricsOf(1);
  const std::string series = "\ntessera_region_frames_dropped_total{reason=\"malformed\"} ";
  const auto at = metrics.find(series);
  ASSERT_NE(at, std::string::npos);
  EXPECT_GE(std::atoi(metrics.c_str() + at + series.size()), 2) << metrics.substr(at, 200);
}

TEST_F(NeighborTest, AnAcceptorOfAnotherKeyLeadsNowhere) {
  line_.endpoint->Open(IdentityOf(2, net::SigningKey::Make()));
  ASSERT_TRUE(line_.Until([&] { return line_.endpoint->acceptor_stats().refused > 0; }));
  ASSERT_TRUE(worker_->WaitForLine("link refused reason=BAD_CREDENTIAL"));
  line_.endpoint->Open(IdentityOf(2, StandaloneKey()));
  Link();  // it dials again, and the right one is taken
  EXPECT_TRUE(StepTo(Tick(5)));
}

TEST_F(NeighborTest, AnAcceptorOfAnotherRegionLeadsNowhere) {
  line_.endpoint->Open(IdentityOf(3, StandaloneKey()));
  ASSERT_TRUE(line_.Until([&] { return line_.endpoint->acceptor_stats().refused > 0; }));
  EXPECT_TRUE(worker_->WaitForLine("link refused reason=WRONG_REGION"));
}

// It lets everybody in, and has no certificate of the region that it plays: nobody sends it a frame.
TEST_F(NeighborTest, AnImpostorAtTheNeighboursAddressLeadsNowhere) {
  net::EndpointIdentity impostor = IdentityOf(2, StandaloneKey());
  impostor.certificate = IdentityOf(3, StandaloneKey()).certificate;
  line_.endpoint->Open(impostor);
  ASSERT_TRUE(line_.Until([&] { return line_.endpoint->acceptor_stats().accepted > 1; }));
  EXPECT_FALSE(line_.connected);
  EXPECT_TRUE(line_.messages.empty());
  line_.endpoint->Open(IdentityOf(2, StandaloneKey()));
  Link();
  EXPECT_TRUE(StepTo(Tick(5)));
}

class CrowdTest : public NeighborTest {
 protected:
  CrowdTest() : NeighborTest(kCrowd) {}
};

TEST_F(CrowdTest, FramesBeyondTheDefaultMessageSizeArrive) {
  ASSERT_GT(kept_.back().size(), net::kMaxMessageBytes);
  Link();
  EXPECT_TRUE(StepTo(Tick(5)));
}

// The worker is region 2: it is dialled.
class UnprovenCallerTest : public WorkerLinkTest {
 protected:
  UnprovenCallerTest() : line_(0) { StartWorker(2); }
  void Dial(const net::Credentials& credentials) {
    const auto peer = line_.endpoint->Connect("127.0.0.1", LinkPort(2), RegionId(2), Incarnation(), credentials);
    ASSERT_TRUE(peer.ok());
    ASSERT_TRUE(line_.Until([&] { return line_.connected || line_.refusal; }));
  }
  void ExpectRefused(const v1::LinkHello& hello, const std::string& why) {
    Dial(PassOf(1, StandaloneKey()));
    line_.SendHello(hello);
    EXPECT_TRUE(line_.Until([&] { return !line_.connected; }));
    EXPECT_TRUE(line_.messages.empty()) << "one that is not expected was sent something";
    EXPECT_TRUE(worker_->WaitForLine(why)) << worker_->said();
  }
  LinkLine line_;
};

TEST_F(UnprovenCallerTest, AnotherKeyIsRefusedByTheAcceptor) {
  Dial(PassOf(1, net::SigningKey::Make()));
  ASSERT_TRUE(line_.refusal.has_value());
  EXPECT_EQ(line_.refusal->reason, net::Refused::kBadCredential);
}

TEST_F(UnprovenCallerTest, APlayersCredentialIsRefusedByTheAcceptor) {
  Dial(net::IssuePlayer(kStandaloneInstanceId, PlayerNumber(1), net::Generation(1), StandaloneKey()));
  ASSERT_TRUE(line_.refusal.has_value());
  EXPECT_EQ(line_.refusal->reason, net::Refused::kBadCredential);
}

// As by a worker that was taken over: its certificate is good, and it signs another for itself.
TEST_F(UnprovenCallerTest, ARegionCannotSpeakForAnother) {
  const net::EndpointIdentity self = IdentityOf(1, StandaloneKey());
  net::Credentials forged = net::CredentialsOf(self);
  forged.statement = net::Sign(net::WorkerCertificate{.instance_id = kStandaloneInstanceId,
                                                      .region = RegionId(3),
                                                      .incarnation = Incarnation(3),
                                                      .key = self.key.verification_key()},
                               self.key);
  Dial(forged);
  ASSERT_TRUE(line_.refusal.has_value());
  EXPECT_EQ(line_.refusal->reason, net::Refused::kBadCredential);
}

TEST_F(UnprovenCallerTest, HelloOfAnotherThanTheCertificatesIsRefused) {
  v1::LinkHello hello = HelloOf(1);
  hello.set_incarnation(2);
  ExpectRefused(hello, "its certificate region 1 incarnation 1");
}

TEST_F(UnprovenCallerTest, OneOfOtherRulesIsRefusedWithTheReasonAndCounted) {
  region::RegionSettings deeper;
  ++deeper.ghost_depth;
  v1::LinkHello hello = HelloOf(1);
  hello.set_rules(region::RulesOf(deeper));
  ExpectRefused(hello, "computes by other rules");
  EXPECT_THAT(MetricsOf(2), testing::HasSubstr("tessera_region_links_refused_total{reason=\"rules\"} 1"));
}

// Maps come into force at both ends, not at the same time.
TEST_F(UnprovenCallerTest, AnotherMapIsNoReasonToRefuse) {
  v1::LinkHello hello = HelloOf(1);
  hello.set_map_version(9);
  Dial(PassOf(1, StandaloneKey()));
  line_.SendHello(hello);
  EXPECT_TRUE(line_.TakeHello().has_value());
}

TEST_F(UnprovenCallerTest, RegionThatIsNoNeighborIsRefused) {
  Dial(PassOf(7, StandaloneKey()));
  line_.SendHello(HelloOf(7));
  EXPECT_TRUE(line_.Until([&] { return !line_.connected; }));
  EXPECT_TRUE(worker_->WaitForLine("region 7 is not expected")) << worker_->said();
}

TEST_F(UnprovenCallerTest, SilenceIsDropped) {
  Dial(PassOf(1, StandaloneKey()));
  EXPECT_TRUE(line_.Until([&] { return !line_.connected; }));
  EXPECT_TRUE(worker_->WaitForLine("it said no hello"));
}

TEST_F(UnprovenCallerTest, NeighborIsAnsweredWithAHelloAndTheFrameOfTickZero) {
  Dial(PassOf(1, StandaloneKey()));
  line_.SendHello(HelloOf(1));
  const std::optional<v1::LinkHello> answer = line_.TakeHello();
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->SerializeAsString(), HelloOf(2).SerializeAsString());
  EXPECT_TRUE(line_.Until([&] { return !line_.messages.empty(); }));
}

}  // namespace
}  // namespace tessera::worker
