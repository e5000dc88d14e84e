#include "client_sdk/game_talk.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client_sdk/testing/test_now.h"

namespace tessera::client {
namespace {

struct GameTalkTest : testing::Test {
  using News = GameTalk::News;

  static replication::NewsOfPlayer Says(std::uint32_t epoch, std::uint32_t last_event, std::vector<std::string> names) {
    replication::NewsOfPlayer news;
    news.epoch = epoch;
    news.last_event = last_event;
    for (std::string& name : names) {
      news.events.emplace_back();
      news.events.back().name = std::move(name);
    }
    return news;
  }
  std::string Events() {
    std::string names;
    for (const GameEvent& event : talk.TakeEvents()) names += event.name + ";";
    return names;
  }

  GameTalk talk;
};

TEST_F(GameTalkTest, GivesEachEventOnce) {
  EXPECT_EQ(talk.Take(Says(1, 2, {"a", "b"})), News::kNew);
  EXPECT_EQ(talk.Take(Says(1, 3, {"b", "c"})), News::kNew);  // it sends again what it does not know to be here
  EXPECT_EQ(Events(), "a;b;c;");
  EXPECT_EQ(talk.Take(Says(2, 4, {"d"})), News::kNew);  // the next owner of the body
  EXPECT_EQ(talk.Take(Says(1, 5, {"e"})), News::kOld);  // the last one speaks still
  EXPECT_EQ(Events(), "d;");
}

TEST_F(GameTalkTest, RefusesMoreEventsThanThereWere) {
  EXPECT_EQ(talk.Take(Says(1, 1, {"a", "b"})), News::kMalformed);
  EXPECT_EQ(Events(), "");
}

TEST_F(GameTalkTest, AfterASilenceEventsMayBeginAnew) {
  EXPECT_EQ(talk.Take(Says(7, 9, {"a"})), News::kNew);
  EXPECT_EQ(talk.Write(kTestNow, false), std::nullopt);  // nobody is connected
  EXPECT_EQ(talk.Take(Says(1, 4, {"b"})), News::kNew);   // a world that was restored
  EXPECT_EQ(Events(), "a;b;");
}

TEST_F(GameTalkTest, WritesWhatIsNotKnownToBeTaken) {
  EXPECT_EQ(talk.Write(kTestNow, true), std::nullopt);
  EXPECT_TRUE(talk.Push("jump", 0).ok());
  ASSERT_EQ(talk.Take(Says(1, 0, {})), News::kNew);  // the first region has spoken
  EXPECT_EQ(talk.Write(kTestNow, false), std::nullopt);
  EXPECT_NE(talk.Write(kTestNow, true), std::nullopt);
  ASSERT_TRUE(talk.next());
  replication::NewsOfPlayer taken = Says(1, 0, {});
  taken.last_command = *talk.next() - 1;
  ASSERT_EQ(talk.Take(taken), News::kNew);
  EXPECT_EQ(talk.Write(kTestNow + std::chrono::seconds(1), true), std::nullopt);
}

}  // namespace
}  // namespace tessera::client
