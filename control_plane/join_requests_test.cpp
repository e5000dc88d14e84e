// Requests of the players' door in JSON, without the door.
#include "control_plane/join_requests.h"

#include <gmock/gmock.h>

#include <memory>
#include <string>

#include "control_plane/memory_store.h"
#include "control_plane/testing/loaded_plane.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

class JoinRequestsTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_NE(plane_, nullptr); }
  PageAnswer Ask(const std::string& path, const std::string& body) {
    return requests_.CarryOut({.path = path, .body = body, .from = "192.0.2.7", .address = "192.0.2.7"},
                              [] { return false; });
  }

  MemoryStore store_;
  ControlMetrics metrics_;
  const std::unique_ptr<ControlPlane> plane_ = LoadPlane(store_);
  JoinRequests requests_{*plane_, metrics_, JoinRequests::Askers::kStrangers};
};

TEST_F(JoinRequestsTest, ThereAreThreePaths) {
  for (const char* path : {"/v1/join", "/v1/leave", "/v1/instances"}) EXPECT_TRUE(JoinRequests::Has(path)) << path;
  for (const char* path : {"", "/", "/v1/join/", "/v1/joins"}) EXPECT_FALSE(JoinRequests::Has(path)) << path;
}

TEST_F(JoinRequestsTest, AListOfNoWorldsIsEmpty) {
  const PageAnswer answer = Ask("/v1/instances", "{}");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.body, R"({"instances":[]})");
}

TEST_F(JoinRequestsTest, ABodyThatIsNoneOfThePathIsRefused) {
  for (const char* path : {"/v1/join", "/v1/leave", "/v1/instances"}) {
    const PageAnswer answer = Ask(path, R"({"colour": "red"})");
    EXPECT_EQ(answer.status, 400) << path;
    EXPECT_THAT(answer.body, HasSubstr("INVALID_ARGUMENT")) << path;
  }
}

TEST_F(JoinRequestsTest, NobodyJoinsAWorldThatIsNotThere) {
  const PageAnswer answer = Ask("/v1/join", R"({"name": "ada", "instance": "inst-7"})");
  EXPECT_EQ(answer.status, 404);
  EXPECT_THAT(answer.body, HasSubstr("NOT_FOUND"));
}

}  // namespace
}  // namespace tessera::control
