// Players who come late, and players who come back.
#include <csignal>
#include <filesystem>
#include <fstream>

#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {
namespace {

class PlayerTest : public WorldTest {
 protected:
  void SetUp() override {
    Start({.scene = "", .regions = 4, .bots = 1, .hosts = 2, .capacity = 4});
    ASSERT_TRUE(PlayUntil("the world runs", [this] { return ReportOf(1).tick() > 120; }));
  }
  std::unique_ptr<local::Bot> Join(const std::string& name, const std::vector<std::uint8_t>& returning = {}) {
    auto bot = local::Bot::Join(run_->cluster().control_address(), run_->instance_id(), name, 7, returning);
    EXPECT_TRUE(bot.ok()) << bot.status();
    return bot.ok() ? *std::move(bot) : nullptr;
  }
  testing::AssertionResult PlayWith(local::Bot& bot, const std::string& what, const std::function<bool()>& holds) {
    return PlayUntil(what, [&] { return bot.Frame(client::Clock::now()) && holds(); });
  }
  const client::SeenBody* Seen(BodyId body) {
    const auto& world = run_->bots()[0]->client().World();
    const auto found = world.find(body);
    return found == world.end() ? nullptr : &found->second;
  }
  std::vector<std::uint8_t> ReadToken(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  local::TemporaryFolder folder_;
};

TEST_F(PlayerTest, OneWhoJoinsLateSeesAllAndIsSeenAndSteers) {
  const auto late = Join("late");
  ASSERT_NE(late, nullptr);
  EXPECT_EQ(late->client().player(), PlayerNumber(2));
  ASSERT_TRUE(PlayWith(*late, "all is seen", [&] { return late->client().World().size() >= kBodies + 2; }));
  ASSERT_TRUE(PlayWith(*late, "it steers", [&] { return late->client().last_applied_input() > 10; }));
  ASSERT_TRUE(PlayWith(*late, "it is seen", [&] { return Seen(late->client().own_body()) != nullptr; }));
  EXPECT_TRUE(late->client().Leave().ok());
  EXPECT_TRUE(PlayUntil("its body is gone", [&] { return Seen(late->client().own_body()) == nullptr; }));
}

TEST_F(PlayerTest, OneWhoseProcessWasKilledComesBackAsItselfToItsBody) {
  const std::string file = folder_.path() + "/player";
  local::ChildProcess game({support::BinaryPath("tessera"), "--control", run_->cluster().control_address(), "client",
                            run_->instance_id(), "--name", "ann", "--player-file", file},
                           folder_.path() + "/log");
  const BodyId body = PlayerBodyId(PlayerNumber(2));
  ASSERT_TRUE(PlayUntil("it walks", [&] {
    const client::SeenBody* seen = Seen(body);
    return seen != nullptr && Length(seen->state.linear_velocity) > 2;
  }));
  game.Signal(SIGKILL);
  ASSERT_TRUE(game.Wait(kPatience).has_value());
  ASSERT_TRUE(PlayUntil("it stands about", [&] { return ReportOf(1).tick() > 400 && Seen(body) != nullptr; }));
  const Vec3d left_at = Seen(body)->state.position;
  const auto back = Join("bob", ReadToken(file));
  ASSERT_NE(back, nullptr);
  EXPECT_EQ(back->client().player(), PlayerNumber(2));
  ASSERT_TRUE(PlayWith(*back, "it sees itself", [&] { return back->client().World().contains(body); }));
  EXPECT_LT(Length(back->client().World().at(body).state.position - left_at), 20) << "where the world left it";
  const std::uint32_t before = back->client().last_applied_input();
  ASSERT_TRUE(PlayWith(*back, "it steers", [&] { return back->client().last_applied_input() > before + 30; }));
  EXPECT_EQ(run_->Latest().players(), 2u);
}

TEST_F(PlayerTest, OneWhoHasLeftForGoodDoesNotComeBack) {
  const auto guest = Join("guest");
  ASSERT_NE(guest, nullptr);
  ASSERT_TRUE(PlayWith(*guest, "it is seen", [&] { return Seen(guest->client().own_body()) != nullptr; }));
  const std::vector<std::uint8_t> token = guest->client().return_token();
  ASSERT_TRUE(guest->client().Leave().ok());
  const auto back = local::Bot::Join(run_->cluster().control_address(), run_->instance_id(), "guest", 7, token);
  EXPECT_EQ(back.status().code(), absl::StatusCode::kFailedPrecondition) << back.status();
  std::vector<std::uint8_t> forged = token;
  forged[forged.size() / 2] ^= 1;
  const auto stranger = local::Bot::Join(run_->cluster().control_address(), run_->instance_id(), "x", 7, forged);
  EXPECT_EQ(stranger.status().code(), absl::StatusCode::kUnauthenticated) << stranger.status();
}

}  // namespace
}  // namespace tessera::end_to_end
