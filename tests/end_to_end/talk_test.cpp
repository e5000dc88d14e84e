// Players and a game on a cluster of real processes: who is let in, what clients ask, what they are answered, and how
// a session ends.
#include <gmock/gmock.h>

#include <fstream>

#include "absl/strings/match.h"
#include "host/temporary_folder.h"
#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {
namespace {

using testing::HasSubstr;

constexpr char kTalkScene[] = R"(
  name: "talk"
  bounds { min { x: -12 y: -2 z: -12 } max { x: 12 y: 20 z: 12 } }
  bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
  player {
    body { name: "player" mass: 80 shape { sphere { radius: 0.5 } } never_sleeps: true }
    spawn_points { x: 6 y: 0.5 z: 6 }
    max_force: 500
    max_speed: 6
  }
)";
constexpr char kTalkGame[] = R"(
function on_join(player)
  if player:name() == "mallory" then player:refuse("not you, mallory") end
end

function on_leave(player) print("bye", player:name()) end

function on_command(player, bytes)
  if bytes == "quit" then
    player:kick("as you like")
  else
    player:send("echo", { what = bytes })
  end
end
)";

class TalkTest : public WorldTest {
 protected:
  void SetUp() override {
    Start({.scene = Write("talk.textproto", kTalkScene),
           .game = Write("talk.lua", kTalkGame),
           .regions = 4,
           .bots = 1,
           .hosts = 2,
           .capacity = 4});
    ASSERT_TRUE(PlayUntil("the world runs", [this] { return ReportOf(1).tick() > 60; }));
  }
  std::string Write(const std::string& name, const std::string& text) {
    const std::string path = folder_.path() + "/" + name;
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  std::unique_ptr<local::Bot> Join(const std::string& name) {
    auto bot = local::Bot::Join(run_->cluster().control_address(), run_->instance_id(), name, 7);
    EXPECT_TRUE(bot.ok()) << bot.status();
    return bot.ok() ? *std::move(bot) : nullptr;
  }
  testing::AssertionResult PlayWith(local::Bot& bot, const std::string& what, const std::function<bool()>& holds) {
    return PlayUntil(what, [&] {
      (void)bot.Frame(client::Clock::now());
      return holds();
    });
  }
  static bool Ended(local::Bot& bot) { return bot.client().state() == client::ClientState::kEnded; }

  host::TemporaryFolder folder_;
};

TEST_F(TalkTest, OneWhoIsRefusedReadsWhyAndDoesNotComeBack) {
  const std::unique_ptr<local::Bot> mallory = Join("mallory");
  ASSERT_NE(mallory, nullptr);
  const std::vector<std::uint8_t> token = mallory->client().return_token();
  ASSERT_TRUE(PlayWith(*mallory, "mallory is refused", [&] { return Ended(*mallory); }));
  EXPECT_EQ(mallory->client().reason(), absl::AbortedError("not you, mallory"));
  ASSERT_TRUE(PlayUntil("the control plane knows", [&] {
    const auto again = local::Bot::Join(run_->cluster().control_address(), run_->instance_id(), "mallory", 7, token);
    return absl::IsAborted(again.status()) && absl::StrContains(again.status().message(), "not you, mallory");
  }));
  EXPECT_FALSE(run_->bots()[0]->client().World().contains(PlayerBodyId(mallory->client().player())));
}

TEST_F(TalkTest, CommandsAreAnsweredInOrderAcrossBordersAndAKickEndsTheSession) {
  const std::unique_ptr<local::Bot> ada = Join("Ада");
  ASSERT_NE(ada, nullptr);
  std::vector<std::string> heard;
  int given = 0, frames = 0;
  ASSERT_TRUE(PlayWith(*ada, "60 commands are answered while it walks over borders", [&] {
    if (frames++ % 4 == 0 && given < 60 && ada->client().Send("c" + std::to_string(given)).ok()) ++given;
    for (const client::GameEvent& event : ada->client().TakeGameEvents()) {
      EXPECT_EQ(event.name, "echo");
      heard.push_back(std::get<std::string>(event.values.at(0).second));
    }
    return heard.size() >= 60 && ada->region_changes() > 0;
  }));
  for (std::size_t i = 0; i < heard.size(); ++i) EXPECT_EQ(heard[i], "c" + std::to_string(i));
  EXPECT_EQ(heard.size(), 60U);
  EXPECT_EQ(run_->bots()[0]->client().NameOf(ada->client().player()), "Ада");

  ASSERT_TRUE(ada->client().Send("quit").ok());
  ASSERT_TRUE(PlayWith(*ada, "it is kicked", [&] { return Ended(*ada); }));
  EXPECT_EQ(ada->client().reason(), absl::AbortedError("as you like"));
  const BodyId body = PlayerBodyId(ada->client().player());
  ASSERT_TRUE(PlayUntil("its body is gone", [&] { return !run_->bots()[0]->client().World().contains(body); }));
  ASSERT_TRUE(PlayUntil("the game said bye", [&] {
    return absl::StrContains(Tessera({"game", "logs", run_->instance_id()}).out, "bye Ада");
  }));
}

TEST_F(TalkTest, ABadNameIsRefusedByTheControlPlane) {
  const std::string address = run_->cluster().control_address();
  const auto why_not = [&](const std::string& name) {
    return std::string(local::Bot::Join(address, run_->instance_id(), name, 7).status().message());
  };
  EXPECT_THAT(why_not(std::string(33, 'x')), HasSubstr("player_name: 33 bytes are more than 32"));
  EXPECT_THAT(why_not("a\nb"), HasSubstr("player_name: has a control character"));
}

}  // namespace
}  // namespace tessera::end_to_end
