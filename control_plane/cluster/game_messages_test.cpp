// Messages of backends on records and entries alone.
#include "control_plane/cluster/game_messages.h"

#include <gmock/gmock.h>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class GameMessagesTest : public ::testing::Test {
 protected:
  GameMessagesTest() {
    records::Instance next = instance_.record;
    next.add_bodies()->set_first(5);
    next.mutable_bodies(0)->set_last(5);
    Players players;
    for (const std::uint32_t number : {2, 3}) {
      records::StoredPlayer known;
      known.mutable_player()->set_number(number);
      known.mutable_player()->set_left(number == 3);
      players.Put(known);
    }
    EXPECT_TRUE(rig_.state->StoreWithPlayers(instance_, next, players).ok());
  }
  v1::SendToGameRequest Gift(const std::string& request_id) const {
    v1::SendToGameRequest request;
    request.set_id(instance_.record.id());
    request.set_request_id(request_id);
    request.set_name("gift");
    return request;
  }
  std::uint64_t Add(const v1::SendToGameRequest& request) { return *messages_->Add(instance_, request, rig_.now); }
  std::string Refusal(const v1::SendToGameRequest& request) {
    return messages_->Add(instance_, request, rig_.now).status().ToString();
  }
  void Answer(std::uint64_t number, const std::string& refused = "") {
    v1::WorkerReport report;
    v1::BackendAnswer& answer = *report.add_backend_answers();
    answer.set_number(number);
    answer.set_refused(refused);
    messages_->TakeAnswers(instance_, report);
  }
  std::optional<absl::Status> Outcome(std::uint64_t number) const {
    return messages_->Outcome(instance_.record.id(), number);
  }
  void RestartControlPlane() {
    messages_ = std::make_unique<GameMessages>(*rig_.state);
    ASSERT_TRUE(messages_->Load().ok());
  }

  StateRig rig_;
  HostEntry& alpha_ = rig_.AddHost("alpha");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_});
  std::unique_ptr<GameMessages> messages_ = std::make_unique<GameMessages>(*rig_.state);
};

TEST_F(GameMessagesTest, IsOrderedUntilTheFirstAnswerAlsoByTheNextControlPlane) {
  v1::SendToGameRequest to_player = Gift("b");
  to_player.set_player(2);
  const std::uint64_t first = Add(Gift("a")), second = Add(to_player);
  EXPECT_LT(first, second);
  EXPECT_TRUE(alpha_.desired_changed);
  RestartControlPlane();
  const auto ordered = messages_->Unanswered(instance_);
  ASSERT_THAT(ordered, SizeIs(2));
  EXPECT_EQ(ordered[0].number(), first);
  EXPECT_EQ(ordered[0].body(), 0U) << "the world";
  EXPECT_EQ(ordered[1].body(), PlayerBodyId(PlayerNumber(2)).value());
  EXPECT_EQ(ordered[1].name(), "gift");
  EXPECT_EQ(instance_.game_messages_waiting, 2U);
  EXPECT_EQ(Outcome(first), std::nullopt);
  Answer(first);
  Answer(first, "too late");
  Answer(second, "body 7 is gone");
  EXPECT_EQ(Outcome(first), absl::OkStatus());
  EXPECT_THAT(Outcome(second)->ToString(), HasSubstr("FAILED_PRECONDITION: target: body 7 is gone"));
  EXPECT_THAT(messages_->Unanswered(instance_), IsEmpty());
  EXPECT_EQ(instance_.game_messages_waiting, 0U);
}

TEST_F(GameMessagesTest, ARequestThatIsMadeAgainIsTheSameMessage) {
  const std::uint64_t number = Add(Gift("a"));
  EXPECT_EQ(messages_->Find(instance_, "a"), number);
  EXPECT_EQ(messages_->Find(instance_, "b"), 0U);
  Answer(number);
  RestartControlPlane();
  EXPECT_EQ(messages_->Find(instance_, "a"), number);
  EXPECT_EQ(Outcome(number), absl::OkStatus());
}

TEST_F(GameMessagesTest, NumbersAscendAlsoWhereTheClockIsSetBack) {
  const std::uint64_t first = Add(Gift("a"));
  rig_.now.unix_time -= std::chrono::hours(1);
  EXPECT_GT(Add(Gift("b")), first);
}

TEST_F(GameMessagesTest, WhatIsWrongNamesTheField) {
  EXPECT_THAT(Refusal(Gift("")), HasSubstr("INVALID_ARGUMENT: request_id: must have 1 to 128 bytes"));
  EXPECT_THAT(Refusal(Gift(std::string(129, 'x'))), HasSubstr("request_id"));
  v1::SendToGameRequest request = Gift("a");
  request.set_name("");
  EXPECT_THAT(Refusal(request), HasSubstr("name: must have 1 to 32 bytes"));
  request = Gift("a");
  request.set_body(6);
  EXPECT_THAT(Refusal(request), HasSubstr("NOT_FOUND: body: inst-1 has no body 6"));
  for (const std::uint32_t player : {0U, 3U, 9U}) {
    request.set_player(player);
    EXPECT_THAT(Refusal(request), HasSubstr(absl::StrCat("NOT_FOUND: player: inst-1 has no player ", player)));
  }
  request = Gift("a");
  request.add_values()->set_name("x");
  EXPECT_THAT(Refusal(request), HasSubstr("values[0]: has no value"));
  EXPECT_EQ(messages_->Find(instance_, "a"), 0U) << "nothing was made";
  request = Gift("a");
  request.set_validate_only(true);
  EXPECT_EQ(Add(request), 0U);
}

TEST_F(GameMessagesTest, OnlySoManyWait) {
  for (std::size_t i = 0; i < kMaxGameMessages; ++i) Add(Gift(absl::StrCat(i)));
  EXPECT_THAT(Refusal(Gift("more")), HasSubstr("RESOURCE_EXHAUSTED: id: 64 messages to inst-1 wait already"));
  Answer(messages_->Find(instance_, "7"));
  EXPECT_NE(Add(Gift("more")), 0U);
}

TEST_F(GameMessagesTest, TheOldestRequestsAreForgotten) {
  for (std::size_t i = 0; i < kMaxGameRequestsKept + 3; ++i) Answer(Add(Gift(absl::StrCat(i))));
  EXPECT_EQ(messages_->Find(instance_, "2"), 0U);
  EXPECT_NE(messages_->Find(instance_, "3"), 0U);
  EXPECT_THAT(*rig_.store.List("message/1/"), SizeIs(kMaxGameRequestsKept));
}

TEST_F(GameMessagesTest, WhatCannotBeStoredIsNotSent) {
  rig_.store.FailNext(1);
  EXPECT_THAT(Refusal(Gift("a")), HasSubstr("UNAVAILABLE"));
  EXPECT_THAT(messages_->Unanswered(instance_), IsEmpty());
  const std::uint64_t number = Add(Gift("a"));
  rig_.store.FailNext(1);
  Answer(number);
  EXPECT_EQ(Outcome(number), std::nullopt) << "nobody hears of what may not outlive this process";
  Answer(number);
  EXPECT_EQ(Outcome(number), absl::OkStatus());
}

TEST_F(GameMessagesTest, OneThatNobodyTakesIsGivenUp) {
  const std::uint64_t number = Add(Gift("a"));
  messages_->Expire(instance_, rig_.now);
  EXPECT_EQ(Outcome(number), std::nullopt);
  rig_.now.unix_time += kGameMessagePatience;
  messages_->Expire(instance_, rig_.now);
  EXPECT_THAT(Outcome(number)->message(), HasSubstr("no region has had the target"));
}

TEST_F(GameMessagesTest, OfAnInstanceThatEndedNothingIsWaitedFor) {
  const std::uint64_t number = Add(Gift("a"));
  records::Instance next = instance_.record;
  next.set_state(v1::INSTANCE_STATE_ENDED);
  ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  EXPECT_EQ(Outcome(number)->code(), absl::StatusCode::kAborted);
  messages_->Forget(instance_.number);
  EXPECT_THAT(*rig_.store.List("message/"), IsEmpty());
}

}  // namespace
}  // namespace tessera::control
