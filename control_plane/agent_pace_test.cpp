#include "control_plane/agent_pace.h"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>

#include "control_plane/doors_fixture.h"
#include "tessera/v1/agent_link.grpc.pb.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr net::TokenBucket::TimePoint kStart{seconds(1000)};
constexpr net::Rate kRate{.per_s = 1000, .burst = 100};

TEST(AgentPaceTest, ABurstIsReadAtOnceAfterARestAndThenTheRate) {
  AgentPace pace(kStart, kRate);
  const net::TokenBucket::TimePoint rested = kStart + seconds(10);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(pace.Pause(rested, 50).count(), 0) << i;
  net::TokenBucket::TimePoint now = rested;
  for (int i = 0; i < 10'000; ++i) now += pace.Pause(now, 50);
  const auto took = now - rested;
  EXPECT_LE(took, milliseconds(10'000));
  EXPECT_GE(took, milliseconds(10'000) - AgentPace::kShortestPause);
}

TEST(AgentPaceTest, NobodyWaitsWhoSaysLessThanTheRate) {
  AgentPace pace(kStart, kRate);
  for (int i = 0; i < 10'000; ++i) EXPECT_EQ(pace.Pause(kStart + i * milliseconds(1), 50).count(), 0) << i;
}

TEST(AgentPaceTest, DiallingAnewGivesNoBurst) {
  net::TokenBucket::TimePoint now = kStart;
  for (int stream = 0; stream < 100; ++stream) {
    AgentPace pace(now, kRate);
    for (int i = 0; i < 100; ++i) now += pace.Pause(now, 50);
  }
  EXPECT_GE(now - kStart, 100 * (milliseconds(100) - AgentPace::kShortestPause));
}

TEST(AgentPaceTest, ALongMessageCountsByItsBytes) {
  AgentPace pace(kStart, kRate);
  EXPECT_EQ(pace.Pause(kStart, 999 * kBytesOfAMessage), seconds(1));
}

// The longest message, 64 MiB, holds up its own stream alone, and not for long.
TEST(AgentPaceTest, NoMessageIsFollowedByALongPause) {
  AgentPace pace(kStart);
  net::TokenBucket::TimePoint now = kStart;
  for (int i = 0; i < 100; ++i) {
    const auto pause = pace.Pause(now, std::size_t{64} << 20);
    EXPECT_LT(pause, seconds(1));
    now += pause;
  }
}

// All of it is heard in the end, as the hello at its end says, for which the stream is ended.
TEST_F(DoorsTest, AnAgentThatSaysTooMuchIsReadAtARate) {
  const Host host = JoinHost("alpha");
  const auto stub = v1::AgentLinkService::NewStub(Dialled(server_->operators(), host.credentials));
  grpc::ClientContext context;
  const auto stream = stub->Attach(&context);
  v1::AgentMessage hello, heartbeat;
  *hello.mutable_hello() = HelloOf(host);
  heartbeat.mutable_heartbeat();
  const auto begun = std::chrono::steady_clock::now();
  ASSERT_TRUE(stream->Write(hello));
  constexpr int kHeartbeats = 5'000;
  for (int i = 0; i < kHeartbeats; ++i) ASSERT_TRUE(stream->Write(heartbeat)) << i;
  ASSERT_TRUE(stream->Write(hello));
  v1::ControlMessage answer;
  while (stream->Read(&answer)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  const auto took = std::chrono::steady_clock::now() - begun;
  EXPECT_GE(took, std::chrono::duration<double>(kHeartbeats / kAgentMessages.per_s) - AgentPace::kShortestPause);
}

}  // namespace
}  // namespace tessera::control
