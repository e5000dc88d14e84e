// The C interface: joining by a grant.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "client_sdk/include/tessera/connect.h"
#include "client_sdk/testing/fake_instance.h"
#include "client_sdk/testing/fake_tls.h"
#include "client_sdk/testing/instance_door.h"
#include "trust/certificate.h"

namespace tessera::client {
namespace {

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

// Control planes of one cluster, as connect.h takes them.
struct CControlListTest : CGrantTest {
  // HOST:PORT#FINGERPRINT of a port where nobody listens.
  std::string Nobody() {
    const int held = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at;
    EXPECT_EQ(bind(held, reinterpret_cast<const sockaddr*>(&at), size), 0);
    EXPECT_EQ(getsockname(held, reinterpret_cast<sockaddr*>(&at), &size), 0);
    ports.push_back(held);
    return "127.0.0.1:" + std::to_string(ntohs(at.sin_port)) + "#" + fingerprint;
  }
  void TearDown() override {
    CGrantTest::TearDown();
    for (const int port : ports) close(port);
  }
  tessera_code Join(const std::string& addresses) {
    tessera_join_options options = TESSERA_JOIN_OPTIONS;
    options.control_address = addresses.c_str();
    options.instance_id = FakeInstance::kId;
    return tessera_join(&options, &client);
  }

  trust::KeyedCertificate authority = *trust::MakeAuthority();
  std::string fingerprint = trust::ReadCertificate(authority.certificate)->fingerprint;
  InstanceDoor leader{instance, TlsWith(*trust::IssueServer(authority, "01"), authority.certificate)};
  std::vector<int> ports;  // taken, so that nobody else is there
};

TEST_F(CControlListTest, JoinsByTheOneThatLeadsAndLeavesThere) {
  ASSERT_EQ(Join(Nobody() + "," + leader.address() + "#" + fingerprint), TESSERA_OK) << tessera_last_error();
  ASSERT_EQ(PollUntil([&] { return tessera_get_state(client) == TESSERA_WAITING; }), TESSERA_OK);
  EXPECT_EQ(tessera_leave(client, 10'000), TESSERA_OK) << tessera_last_error();
  EXPECT_EQ(instance.left, 1);
}

TEST_F(CControlListTest, ListsTheWorldsOfTheOneThatLeads) {
  instance.list.instances.emplace_back().set_id("plaza-1");
  tessera_instance_info info = TESSERA_INSTANCE_INFO;
  std::size_t count = 0;
  const std::string addresses = Nobody() + "," + leader.address() + "#" + fingerprint;
  ASSERT_EQ(tessera_list_instances(addresses.c_str(), 10'000, &info, sizeof info, 1, &count), TESSERA_OK)
      << tessera_last_error();
  EXPECT_EQ(count, 1U);
  EXPECT_STREQ(info.id, "plaza-1");
}

TEST_F(CControlListTest, SaysOfEachWhyItDoesNotServe) {
  const std::string one = Nobody(), two = Nobody();
  const auto plain = [](const std::string& address) { return address.substr(0, address.find('#')); };
  EXPECT_EQ(Join(one + "," + two), TESSERA_UNAVAILABLE);
  EXPECT_EQ(client, nullptr);
  const std::string error = tessera_last_error();
  EXPECT_EQ(error.rfind("no control plane of " + plain(one) + ", " + plain(two) + " serves: " + plain(one) + ": ", 0),
            0U)
      << error;
  EXPECT_NE(error.find("; " + plain(two) + ": "), std::string::npos) << error;
}

TEST_F(CControlListTest, RefusesAListWithoutAnAddress) {
  for (const char* none : {",", ",,", " "}) {
    EXPECT_EQ(Join(none), TESSERA_INVALID_ARGUMENT) << none;
    std::size_t count = 0;
    EXPECT_EQ(tessera_list_instances(none, 1000, nullptr, 0, 0, &count), TESSERA_INVALID_ARGUMENT) << none;
  }
  EXPECT_STREQ(tessera_last_error(), "\" \" is not of the form HOST:PORT");
}

}  // namespace
}  // namespace tessera::client
