// The C interface: joining by a grant.
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "client_sdk/include/tessera/connect.h"

namespace tessera::client {
namespace {
#include "client_sdk/testing/fake_instance.h"
#include "client_sdk/testing/fake_tls.h"
#include "client_sdk/testing/instance_door.h"
#include "trust/certificate.h"

struct CGrantTest : testing::Test {
  void TearDown() override { tessera_close(client); }
  tessera_code PollUntil(const std::function<bool()>& done) {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    tessera_code code = TESSERA_OK;
    while (!done() && std::chrono::steady_clock::now() < limit && code == TESSERA_OK) {
      instance.Service();
      code = tessera_poll(client, now);
    }
    return code;
  }

  FakeInstance instance{1};
  InstanceDoor door{instance};
  tessera_client* client = nullptr;
  std::int64_t now = std::int64_t{3600} * 1'000'000'000;
};

TEST_F(CGrantTest, JoinsByAGrantAloneAndHasTheSceneOnceItIsIn) {
  const std::vector<std::uint8_t> grant = instance.Grant();
  ASSERT_EQ(tessera_join_grant(grant.data(), grant.size(), nullptr, &client), TESSERA_OK) << tessera_last_error();
  EXPECT_EQ(tessera_get_state(client), TESSERA_JOINING);
  tessera_scene_info scene = TESSERA_SCENE_INFO;
  ASSERT_EQ(tessera_get_scene(client, &scene), TESSERA_OK);
  EXPECT_EQ(scene.body_count, 0u);
  ASSERT_EQ(PollUntil([&] { return tessera_get_state(client) == TESSERA_WAITING; }), TESSERA_OK);
  ASSERT_EQ(tessera_get_scene(client, &scene), TESSERA_OK);
  EXPECT_STREQ(scene.name, "plaza");
  EXPECT_EQ(scene.body_count, 1u);
  EXPECT_EQ(instance.scenes_fetched, 0);
  EXPECT_EQ(tessera_leave(client, 100), TESSERA_OK);
  EXPECT_EQ(tessera_get_state(client), TESSERA_ENDED);
  EXPECT_EQ(instance.left, 0) << "nobody was told to";
}

TEST_F(CGrantTest, ASceneThatTheCallerHasIsTakenAndTheOneWhoGaveTheGrantIsTold) {
  const std::vector<std::uint8_t> grant = instance.Grant();
  const std::string scene = instance.packed_scene();
  struct Told {
    std::vector<std::uint8_t> token;
    int freed = 0;
  } told;
  tessera_grant_options options = TESSERA_GRANT_OPTIONS;
  options.scene = scene.data();
  options.scene_size = scene.size();
  options.user = &told;
  options.on_leave = [](void* user, const uint8_t* token, size_t size, uint32_t) {
    static_cast<Told*>(user)->token.assign(token, token + size);
    return tessera_set_last_error(TESSERA_UNAVAILABLE, "nobody home");
  };
  options.free_user = [](void* user) { ++static_cast<Told*>(user)->freed; };
  ASSERT_EQ(tessera_join_grant(grant.data(), grant.size(), &options, &client), TESSERA_OK) << tessera_last_error();
  ASSERT_EQ(PollUntil([&] { return tessera_get_state(client) == TESSERA_WAITING; }), TESSERA_OK);
  EXPECT_TRUE(instance.regions[0]->scene_requests.empty());
  std::vector<std::uint8_t> token(TESSERA_MAX_TOKEN);
  token.resize(tessera_return_token(client, token.data(), token.size()));
  EXPECT_EQ(tessera_leave(client, 100), TESSERA_UNAVAILABLE);
  EXPECT_STREQ(tessera_last_error(), "nobody home");
  EXPECT_EQ(told.token, token);
  EXPECT_EQ(told.freed, 0);
  tessera_close(client);
  EXPECT_EQ(told.freed, 1);
  client = nullptr;
  EXPECT_EQ(tessera_join_grant(grant.data(), 7, &options, &client), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(told.freed, 2) << "when joining fails, too";
}

TEST_F(CGrantTest, ANewGrantIsNeededWhereNobodyAnswersAnyMore) {
  const std::vector<std::uint8_t> grant = instance.Grant();
  ASSERT_EQ(tessera_join_grant(grant.data(), grant.size(), nullptr, &client), TESSERA_OK) << tessera_last_error();
  ASSERT_EQ(PollUntil([&] { return tessera_get_state(client) == TESSERA_WAITING; }), TESSERA_OK);
  instance.BecomeAnother(0);
  EXPECT_EQ(PollUntil([&] {
              now += 50'000'000;
              return false;
            }),
            TESSERA_NEW_GRANT_NEEDED);
  EXPECT_NE(std::string(tessera_last_error()).find("no region answers any more"), std::string::npos);
}

TEST_F(CGrantTest, RefusesWhatIsNoGrant) {
  const std::vector<std::uint8_t> grant = instance.Grant();
  const auto refuses = [&](tessera_code code, const char* what) {
    EXPECT_EQ(code, TESSERA_INVALID_ARGUMENT) << what;
    EXPECT_NE(std::string(tessera_last_error()).find(what), std::string::npos) << tessera_last_error();
  };
  refuses(tessera_join_grant(grant.data(), grant.size(), nullptr, nullptr), "client: is NULL");
  refuses(tessera_join_grant(nullptr, 0, nullptr, &client), "grant: is NULL");
  refuses(tessera_join_grant(grant.data(), TESSERA_MAX_GRANT + 1, nullptr, &client), "grant_size");
  refuses(tessera_join_grant("no grant", 8, nullptr, &client), "this is no join grant");
  tessera_grant_options options = TESSERA_GRANT_OPTIONS;
  options.size = 4;
  refuses(tessera_join_grant(grant.data(), grant.size(), &options, &client), "options.size");
  options = TESSERA_GRANT_OPTIONS;
  options.scene_size = 3;
  refuses(tessera_join_grant(grant.data(), grant.size(), &options, &client), "options.scene: is NULL");
  options.scene = "abc";
  refuses(tessera_join_grant(grant.data(), grant.size(), &options, &client), "packed scene: this is none");
  EXPECT_EQ(client, nullptr);
}

TEST_F(CGrantTest, TheControlPlaneGivesAGrantThatJoins) {
  tessera_join_options options = TESSERA_JOIN_OPTIONS;
  options.control_address = instance.address.c_str();
  options.instance_id = FakeInstance::kId;
  std::vector<std::uint8_t> grant(TESSERA_MAX_GRANT);
  std::size_t size = 0;
  ASSERT_EQ(tessera_get_grant(&options, grant.data(), 10, &size), TESSERA_OK) << tessera_last_error();
  EXPECT_GT(size, 10u) << "it does not fit, and is not written";
  EXPECT_EQ(grant[0], 0);
  ASSERT_EQ(tessera_get_grant(&options, grant.data(), grant.size(), &size), TESSERA_OK) << tessera_last_error();
  ASSERT_EQ(tessera_join_grant(grant.data(), size, nullptr, &client), TESSERA_OK) << tessera_last_error();
  ASSERT_EQ(PollUntil([&] { return tessera_get_state(client) == TESSERA_WAITING; }), TESSERA_OK);
  EXPECT_EQ(tessera_player(client), 2u);
  options.instance_id = "nowhere-9";
  EXPECT_EQ(tessera_get_grant(&options, grant.data(), grant.size(), &size), TESSERA_NOT_FOUND);
  EXPECT_EQ(size, 0u);
  EXPECT_EQ(tessera_get_grant(&options, grant.data(), grant.size(), nullptr), TESSERA_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace tessera::client
