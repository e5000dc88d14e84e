// One request to a door: over a socket, by TLS of the right cluster and of others, and to doors that misbehave.
#include "client_sdk/connect/door_call.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>

#include "client_sdk/testing/fake_door.h"
#include "client_sdk/testing/fake_tls.h"
#include "host/temporary_folder.h"
#include "trust/certificate.h"

namespace tessera::client {
namespace {

using std::chrono::steady_clock;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr std::chrono::seconds kCallPatience{20};

steady_clock::time_point Soon() { return steady_clock::now() + kCallPatience; }

struct DoorCallTest : testing::Test {
  DoorAddress At(const std::string& text) {
    const auto address = ParseDoorAddress(text);
    EXPECT_TRUE(address.ok()) << address.status();
    return *address;
  }
  DoorAddress Socket() { return At("unix:" + folder.path() + "/c"); }
  std::unique_ptr<FakeDoor> SocketDoor(FakeDoor::Answerer answerer) {
    return std::make_unique<FakeDoor>(folder.path() + "/c.json", std::move(answerer));
  }
  // The result of an answer that goes over the wire as it is.
  absl::StatusOr<DoorAnswer> Answered(const std::string& wire) {
    const auto door = SocketDoor([&](const std::string&, const std::string&) { return wire; });
    auto answer = AskDoor(Socket(), "/v1/join", "{}", Soon());
    unlink((folder.path() + "/c.json").c_str());
    return answer;
  }

  host::TemporaryFolder folder;
  trust::KeyedCertificate authority = *trust::MakeAuthority();
  trust::KeyedCertificate own = *trust::IssueServer(authority, "01");
  std::string fingerprint = trust::ReadCertificate(authority.certificate)->fingerprint;
  FakeDoor::Answerer fine = [](const std::string&, const std::string&) { return FakeDoor::Http(200, "{}"); };
};

TEST_F(DoorCallTest, ARequestGoesThroughTheSocketAndTheAnswerComesBack) {
  std::string path, body;
  const auto door = SocketDoor([&](const std::string& asked, const std::string& with) {
    path = asked, body = with;
    return FakeDoor::Http(409, R"({"error":"be nice"})");
  });
  const auto answer = AskDoor(Socket(), "/v1/join", R"({"instance":"inst-7"})", Soon());
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->status, 409);
  EXPECT_EQ(answer->body, R"({"error":"be nice"})");
  EXPECT_EQ(path, "/v1/join");
  EXPECT_EQ(body, R"({"instance":"inst-7"})");
}

TEST_F(DoorCallTest, ByTlsTheClustersAuthorityIsEnough) {
  const FakeDoor door(TlsWith(own, authority.certificate), fine);
  const auto answer = AskDoor(At(door.address() + "#" + fingerprint), "/v1/join", "{}", Soon());
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->status, 200);
}

TEST_F(DoorCallTest, AnotherClusterIsToldNothing) {
  const trust::KeyedCertificate other = *trust::MakeAuthority();
  const trust::KeyedCertificate others = *trust::IssueServer(other, "01");
  // One that says nothing of our authority, and one that shows its certificate without being of it.
  for (const std::string& chain : {other.certificate, authority.certificate}) {
    const FakeDoor door(TlsWith(others, chain), fine);
    const auto answer = AskDoor(At(door.address() + "#" + fingerprint), "/v1/join", R"({"ticket":"secret"})", Soon());
    EXPECT_EQ(answer.status().code(), absl::StatusCode::kUnauthenticated) << answer.status();
    EXPECT_THAT(std::string(answer.status().message()),
                StartsWith("control plane at " + door.address() + "#" + fingerprint + ": what answers is not"));
    EXPECT_EQ(door.requests(), 0) << "nothing was sent to it";
  }
}

TEST_F(DoorCallTest, WithoutAFingerprintTheSystemsAuthoritiesCount) {
  const FakeDoor door(TlsWith(own, authority.certificate), fine);
  const auto answer = AskDoor(At(door.address()), "/v1/join", "{}", Soon());
  EXPECT_EQ(answer.status().code(), absl::StatusCode::kUnauthenticated) << answer.status();
  EXPECT_THAT(std::string(answer.status().message()), HasSubstr("HOST:PORT#FINGERPRINT"));
  EXPECT_EQ(door.requests(), 0);
}

TEST_F(DoorCallTest, NobodyOrSomethingElseIsNoDoor) {
  const auto nobody = AskDoor(Socket(), "/v1/join", "{}", Soon());
  EXPECT_EQ(nobody.status().code(), absl::StatusCode::kUnavailable) << nobody.status();
  EXPECT_THAT(std::string(nobody.status().message()), StartsWith("control plane at unix:" + folder.path() + "/c: "));
  EXPECT_EQ(Answered("220 mail.example ESMTP\r\n").status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Answered("").status().code(), absl::StatusCode::kUnavailable);
  const FakeDoor plain(
      [](int socket) -> FakeDoor::Stream {
        char hello[16];
        EXPECT_GT(recv(socket, hello, sizeof hello, 0), 0);
        FakeDoor::Plain(socket).write(FakeDoor::Http(400, "this is no TLS"));
        return {};
      },
      fine);
  const auto no_tls = AskDoor(At(plain.address() + "#" + fingerprint), "/v1/join", "{}", Soon());
  EXPECT_EQ(no_tls.status().code(), absl::StatusCode::kUnavailable) << no_tls.status();
}

TEST_F(DoorCallTest, AnAnswerIsNoLongerThanItsBound) {
  const auto most = Answered(FakeDoor::Http(200, std::string(kMaxDoorAnswerBytes, ' ')));
  ASSERT_TRUE(most.ok()) << most.status();
  EXPECT_EQ(most->body.size(), kMaxDoorAnswerBytes);
  for (const std::string& wire : {FakeDoor::Http(200, std::string(kMaxDoorAnswerBytes + 1, ' ')),
                                  "HTTP/1.1 200 x\r\n\r\n" + std::string(kMaxDoorAnswerBytes + 1, ' ')}) {
    const auto longer = Answered(wire);
    EXPECT_EQ(longer.status().code(), absl::StatusCode::kInternal) << longer.status();
    EXPECT_THAT(std::string(longer.status().message()), HasSubstr("the answer has more than 2097152 bytes"));
  }
}

TEST_F(DoorCallTest, ARedirectionIsNotFollowed) {
  const auto answer = Answered("HTTP/1.1 302 x\r\nLocation: http://127.0.0.1:1/\r\nContent-Length: 0\r\n\r\n");
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->status, 302);
}

// It takes connections and says nothing, as what stands still does.
TEST_F(DoorCallTest, ADoorThatIsNotReachedInItsShareLeavesTimeForTheNext) {
  std::promise<void> over;
  const FakeDoor silent(
      [waited = over.get_future().share()](int) -> FakeDoor::Stream {
        waited.wait();
        return {};
      },
      fine);
  for (const std::string& text : {silent.address() + "#" + fingerprint, silent.address()}) {
    const auto begun = steady_clock::now();
    DoorReach reach{.reached_by = begun + std::chrono::milliseconds(100)};
    const auto answer = AskDoor(At(text), "/v1/join", "{}", begun + kCallPatience, &reach);
    EXPECT_LT(steady_clock::now() - begun, kCallPatience);
    EXPECT_EQ(answer.status().code(), absl::StatusCode::kUnavailable) << answer.status();
    EXPECT_EQ(std::string(answer.status().message()),
              "control plane at " + text + ": is not reached in its share of the time");
    EXPECT_FALSE(reach.sent);
  }
  over.set_value();
}

TEST_F(DoorCallTest, ARequestThatMayHaveComeThereIsKnown) {
  const auto door = SocketDoor([](const std::string&, const std::string&) { return std::string(); });
  DoorReach reach{.reached_by = Soon()};
  EXPECT_EQ(AskDoor(Socket(), "/v1/join", "{}", Soon(), &reach).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(reach.sent);
  DoorReach nobody{.reached_by = Soon()};
  EXPECT_FALSE(AskDoor(At("unix:" + folder.path() + "/none"), "/v1/join", "{}", Soon(), &nobody).ok());
  EXPECT_FALSE(nobody.sent);
}

TEST_F(DoorCallTest, ASlowDoorIsLeftAtTheDeadline) {
  std::promise<void> over;
  const auto door = SocketDoor([&](const std::string&, const std::string&) {
    over.get_future().wait();
    return FakeDoor::Http(200, "{}");
  });
  const auto begun = steady_clock::now();
  const auto answer = AskDoor(Socket(), "/v1/join", "{}", begun + std::chrono::milliseconds(100));
  EXPECT_LT(steady_clock::now() - begun, std::chrono::seconds(5));
  over.set_value();
  EXPECT_EQ(answer.status().code(), absl::StatusCode::kDeadlineExceeded) << answer.status();
  EXPECT_THAT(std::string(answer.status().message()), HasSubstr("no answer"));
  EXPECT_EQ(AskDoor(Socket(), "/v1/join", "{}", begun).status().code(), absl::StatusCode::kDeadlineExceeded);
}

}  // namespace
}  // namespace tessera::client
