// A client of a control plane gets its scene in pieces, or as earlier releases give it.
#include <gtest/gtest.h>

#include "client_sdk/client_fixture.h"

namespace tessera::client {
namespace {

using ClientSceneTest = ClientFixture;

// Each test has a scene that no other has, for a process keeps those that it has seen.
TEST_F(ClientSceneTest, AControlPlaneGivesItInPieces) {
  Make(1, R"(properties { name: "in_pieces" number: 1 } )");
  Join();
  EXPECT_EQ(instance->scenes_fetched, 1);
  EXPECT_EQ(client->scene().name, "plaza");
}

TEST_F(ClientSceneTest, OneOfAnEarlierReleaseGivesItInOneMessage) {
  Make(1, R"(properties { name: "in_one_message" number: 1 } )");
  instance->knows_no_streams = true;
  Join();
  EXPECT_EQ(instance->scenes_fetched, 1);
  EXPECT_EQ(client->scene().name, "plaza");
}

}  // namespace
}  // namespace tessera::client
