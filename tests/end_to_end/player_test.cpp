// Players who come late, and players who come back.
#include <algorithm>
#include <csignal>
#include <filesystem>

#include "host/child_process.h"
#include "host/files.h"
#include "host/temporary_folder.h"
#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {
namespace {

class PlayerTest : public WorldTest {
 protected:
  void SetUp() override { StartWorld({}); }
  void StartWorld(std::function<void(v1::InstanceSpec&)> adjust) {
    Start({.scene = "", .regions = 4, .bots = 1, .hosts = 2, .capacity = 4, .adjust = std::move(adjust)});
    ASSERT_TRUE(PlayUntil("the world runs", [this] { return ReportOf(1).tick() > 120; }));
  }
  // A game of its own that walks, and is killed; the body of its player is `kGuest`.
  void LetGuestDieWalking() {
    auto game = host::ChildProcess::Start(
        {.argv = {support::BinaryPath("tessera"), "--control", run_->cluster().control_address(), "client",
                  run_->instance_id(), "--name", "ann", "--player-file", GuestFile()},
         .log_path = folder_.path() + "/log"});
    ASSERT_TRUE(game.ok()) << game.status();
    // Its body may fall before it has written down who it is.
    ASSERT_TRUE(PlayUntil("it walks and can come back", [&] {
      const client::SeenBody* seen = Seen(kGuest);
      return seen != nullptr && Length(seen->state.linear_velocity) > 2 && !GuestToken().empty();
    }));
    game->Signal(SIGKILL);
    ASSERT_TRUE(game->Wait(kPatience).has_value());
  }
  std::string GuestFile() const { return folder_.path() + "/player"; }
  std::vector<std::uint8_t> GuestToken() const { return ReadToken(GuestFile()); }
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
  static std::vector<std::uint8_t> ReadToken(const std::string& path) {
    const std::string token = host::ReadFile(path, 4096).value_or("");
    return {token.begin(), token.end()};
  }

  static constexpr BodyId kGuest = PlayerBodyId(PlayerNumber(2));
  host::TemporaryFolder folder_;
};

// A body whose player's process was killed stays or goes by the instance's setting.
class LeaverTest : public PlayerTest {
 protected:
  void SetUp() override {}
  void StartWith(v1::LeaverPolicy policy) {
    StartWorld([policy](v1::InstanceSpec& spec) {
      spec.set_leaver_policy(policy);
      spec.mutable_leaver_grace()->set_seconds(1);
    });
  }
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
  ASSERT_NO_FATAL_FAILURE(LetGuestDieWalking());
  const BodyId body = kGuest;
  ASSERT_TRUE(PlayUntil("it stands about", [&] { return ReportOf(1).tick() > 400 && Seen(body) != nullptr; }));
  const Vec3d left_at = Seen(body)->state.position;
  const auto back = Join("bob", GuestToken());
  ASSERT_NE(back, nullptr);
  EXPECT_EQ(back->client().player(), PlayerNumber(2));
  ASSERT_TRUE(PlayWith(*back, "it sees itself", [&] { return back->client().World().contains(body); }));
  EXPECT_LT(Length(back->client().World().at(body).state.position - left_at), 20) << "where the world left it";
  const std::uint32_t before = back->client().last_applied_input();
  ASSERT_TRUE(PlayWith(*back, "it steers", [&] { return back->client().last_applied_input() > before + 30; }));
  EXPECT_EQ(run_->Latest().players(), 2u);
}

// It hangs where it was when the grace was over, until the player is back.
TEST_F(LeaverTest, IsParkedWhereItIsUntilItIsBack) {
  StartWith(v1::LEAVER_POLICY_PARK);
  ASSERT_NO_FATAL_FAILURE(LetGuestDieWalking());
  const auto parked = [&] { return Seen(kGuest) != nullptr && Seen(kGuest)->state.linear_velocity == Vec3f(); };
  ASSERT_TRUE(PlayUntil("it is parked", parked));
  const Vec3d at = Seen(kGuest)->state.position;
  ASSERT_TRUE(PlayOn(2));
  ASSERT_NE(Seen(kGuest), nullptr);
  EXPECT_LT(Length(Seen(kGuest)->state.position - at), 1e-3);
  const auto back = Join("ann", GuestToken());
  ASSERT_NE(back, nullptr);
  EXPECT_EQ(back->client().player(), PlayerNumber(2));
  EXPECT_TRUE(PlayWith(*back, "it walks again", [&] {
    const client::SeenBody* seen = Seen(kGuest);
    return seen != nullptr && Length(seen->state.position - at) > 1;
  }));
}

TEST_F(LeaverTest, IsRemovedWithItsBodyForGood) {
  StartWith(v1::LEAVER_POLICY_REMOVE);
  ASSERT_NO_FATAL_FAILURE(LetGuestDieWalking());
  ASSERT_TRUE(PlayUntil("its body is gone", [&] { return Seen(kGuest) == nullptr; }));
  ASSERT_TRUE(PlayUntil("it is no player any more", [&] { return run_->Latest().players() == 1; }));
  const auto back = local::Bot::Join(run_->cluster().control_address(), run_->instance_id(), "ann", 7, GuestToken());
  EXPECT_EQ(back.status().code(), absl::StatusCode::kFailedPrecondition) << back.status();
}

TEST_F(LeaverTest, StaysInTheWorldOtherwise) {
  StartWith(v1::LEAVER_POLICY_STAY);
  ASSERT_NO_FATAL_FAILURE(LetGuestDieWalking());
  ASSERT_TRUE(PlayOn(4));
  EXPECT_NE(Seen(kGuest), nullptr);
  EXPECT_EQ(run_->Latest().players(), 2u);
}

// Two processes with one return token, on four regions: the one that joined last plays on, the other ends, once, and
// neither throws the other out again.
TEST_F(PlayerTest, OfTwoProcessesOfOnePlayerTheOlderOneEndsOnce) {
  const auto older = Join("ann");
  ASSERT_NE(older, nullptr);
  ASSERT_TRUE(PlayWith(*older, "it steers", [&] { return older->client().last_applied_input() > 10; }));
  const auto newer = Join("ann", older->client().return_token());
  ASSERT_NE(newer, nullptr);
  EXPECT_EQ(newer->client().player(), older->client().player());
  int ended = 0, lost = 0;
  const auto frame = [&] {
    const client::TimePoint now = client::Clock::now();
    if (ended == 0) {
      (void)older->Frame(now);
      ended += static_cast<int>(
          std::ranges::count(older->events(), client::ClientEvent::Kind::kEnded, &client::ClientEvent::kind));
    } else {
      EXPECT_TRUE(older->client().Poll(now).empty()) << "it has ended";
    }
    EXPECT_TRUE(newer->Frame(now)) << newer->client().reason();
    lost += static_cast<int>(
        std::ranges::count(newer->events(), client::ClientEvent::Kind::kRegionLost, &client::ClientEvent::kind));
  };
  const std::uint32_t before = older->client().last_applied_input();
  ASSERT_TRUE(PlayUntil("the older one ends and the newer one steers", [&] {
    frame();
    return ended > 0 && newer->client().last_applied_input() > before + 30;
  }));
  const std::uint64_t then = ReportOf(1).tick();
  ASSERT_TRUE(PlayUntil("four seconds later", [&] {
    frame();
    return ReportOf(1).tick() > then + 240;
  }));
  EXPECT_EQ(ended, 1);
  EXPECT_EQ(lost, 0);
  EXPECT_EQ(older->client().reason(), absl::AlreadyExistsError("another process joined as this player"));
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
