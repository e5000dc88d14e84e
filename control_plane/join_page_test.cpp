#include "control_plane/join_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "absl/strings/escaping.h"
#include "control_plane/retry_after.h"
#include "control_plane/testing/fake_backend.h"
#include "core/world/partition_io.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

std::string JoinBodyFault(const std::string& body) { return std::string(ReadJoinBody(body).status().message()); }

// As the control plane answers.
v1::JoinInstanceResponse JoinedOnTwoRegions() {
  const net::SigningKey instance_key = net::SigningKey::Make();
  const net::Credentials issued = net::IssuePlayer("inst-7", PlayerNumber(3), net::Generation(1), instance_key);
  const net::Seed seed = issued.key.seed();
  v1::JoinInstanceResponse response;
  response.set_player(3);
  response.set_credential(std::string(issued.statement.begin(), issued.statement.end()));
  response.set_credential_key(seed.data(), seed.size());
  response.set_instance_key(issued.instance_key.data(), issued.instance_key.size());
  *response.mutable_map() = ToProto(*MakeGridMap({0, 0, 100, 100}, 2));
  for (const std::uint32_t region : {2U, 1U}) {
    v1::RegionAddress& address = *response.add_regions();
    address.set_region(region);
    address.set_host("10.0.0.1");
    address.set_game_port(20000 + region);
    address.set_incarnation(region);
  }
  response.set_scene_hash(std::string(64, 'a'));
  response.set_tick_rate_hz(60);
  response.set_snapshot_rate_hz(30);
  return response;
}

TEST(JoinPageTest, ABodySaysWhoJoinsWhat) {
  const auto request = ReadJoinBody(R"({"ticket": "abc", "instance": "inst-7", "viewer": true})");
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(request->ticket(), "abc");
  EXPECT_EQ(request->instance_id(), "inst-7");
  EXPECT_TRUE(request->viewer());
  EXPECT_EQ(ReadJoinBody(R"({"name": "Ann", "instance": "inst-7"})")->player_name(), "Ann");
}

TEST(JoinPageTest, ATicketForAnInstanceNamesIt) {
  FakeBackend game{1};
  trust::Ticket ticket = game.Make("ada", {});
  ticket.instance = "inst-9";
  const auto request = ReadJoinBody(R"({"ticket": ")" + game.Sign(ticket) + R"("})");
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(request->instance_id(), "inst-9");
}

TEST(JoinPageTest, ABadBodyNamesTheField) {
  EXPECT_EQ(JoinBodyFault("["), "body: is not a JSON object");
  EXPECT_EQ(JoinBodyFault("[]"), "body: is not a JSON object");
  EXPECT_EQ(JoinBodyFault("{}"), "instance: missing");
  EXPECT_EQ(JoinBodyFault(R"({"instance": 7})"), "instance: is not a text");
  EXPECT_EQ(JoinBodyFault(R"({"instance": "inst-7", "viewer": 1})"), "viewer: is neither true nor false");
  EXPECT_EQ(JoinBodyFault(R"({"instance": "inst-7", "tikcet": ""})"), "tikcet: is not a field of this request");
  EXPECT_THAT(JoinBodyFault(R"({"ticket": ")" + std::string(2000, 'A') + R"("})"), HasSubstr("ticket: 2000 bytes"));
  EXPECT_THAT(JoinBodyFault(R"({"grant": "?"})"), HasSubstr("grant: is not base64"));
  EXPECT_THAT(JoinBodyFault(R"({"grant": "AAAA"})"), HasSubstr("grant: "));
  EXPECT_THAT(JoinBodyFault(std::string(kMaxJoinBodyBytes + 1, ' ')), HasSubstr("body: more than"));
  EXPECT_THAT(JoinBodyFault(std::string(kMaxJoinBodyBytes, '[')), HasSubstr("body: is not"));
}

TEST(JoinPageTest, AGrantIsReadBackAndComesBack) {
  const PageAnswer answer = JoinAnswer("inst-7", JoinedOnTwoRegions());
  ASSERT_EQ(answer.status, 200) << answer.body;
  const auto json = nlohmann::json::parse(answer.body);
  EXPECT_EQ(json["player"], 3);
  EXPECT_EQ(json["instance"], "inst-7");
  std::string bytes;
  ASSERT_TRUE(absl::Base64Unescape(json["grant"].get<std::string>(), &bytes));
  const auto grant = net::DecodeJoinGrant({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  ASSERT_TRUE(grant.ok()) << grant.status();
  EXPECT_EQ(grant->player, PlayerNumber(3));
  EXPECT_EQ(grant->regions[0].region, RegionId(1));
  const std::string body = nlohmann::json{{"grant", json["grant"]}}.dump();
  const auto back = ReadJoinBody(body);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->instance_id(), "inst-7");
  EXPECT_FALSE(back->credential().empty());
  const auto leave = ReadLeaveBody(body);
  ASSERT_TRUE(leave.ok()) << leave.status();
  EXPECT_EQ(leave->credential(), back->credential());
  EXPECT_EQ(leave->credential_key(), back->credential_key());
}

TEST(JoinPageTest, AReturnTokenComesBackAndLeaves) {
  const net::Credentials issued =
      net::IssuePlayer("inst-7", PlayerNumber(3), net::Generation(1), net::SigningKey::Make());
  const net::Seed seed = issued.key.seed();
  const std::string statement(issued.statement.begin(), issued.statement.end());
  const std::string key(reinterpret_cast<const char*>(seed.data()), seed.size());
  const std::string body =
      nlohmann::json{{"instance", "inst-7"}, {"returning", absl::Base64Escape(statement + key)}}.dump();
  const auto back = ReadJoinBody(body);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->credential(), statement);
  EXPECT_EQ(back->credential_key(), key);
  const auto leave = ReadLeaveBody(body);
  ASSERT_TRUE(leave.ok()) << leave.status();
  EXPECT_EQ(leave->instance_id(), "inst-7");
  EXPECT_EQ(leave->credential(), statement);
  EXPECT_EQ(leave->credential_key(), key);

  EXPECT_EQ(JoinBodyFault(R"({"instance": "inst-7", "returning": "?"})"), "returning: is not base64");
  EXPECT_EQ(JoinBodyFault(R"({"instance": "inst-7", "returning": "AAAA"})"), "returning: 3 bytes are no return token");
  EXPECT_THAT(JoinBodyFault(R"({"instance": "inst-7", "returning": ")" + std::string(4000, 'A') + R"("})"),
              HasSubstr("returning: 4000 bytes are more than"));
  EXPECT_EQ(ReadLeaveBody(R"({"returning": "AAAA"})").status().message(), "instance: missing");
  const std::string grant =
      nlohmann::json::parse(JoinAnswer("inst-7", JoinedOnTwoRegions()).body).at("grant").get<std::string>();
  EXPECT_EQ(JoinBodyFault(nlohmann::json{{"grant", grant}, {"returning", "AAAA"}}.dump()),
            "returning: the grant says who comes back; leave it out");
  EXPECT_EQ(ReadLeaveBody(nlohmann::json{{"grant", grant}, {"returning", "AAAA"}}.dump()).status().message(),
            "returning: the grant says who leaves; leave it out");
  EXPECT_EQ(ReadLeaveBody(nlohmann::json{{"grant", grant}, {"instance", "inst-8"}}.dump()).status().message(),
            "instance: is not that of the grant");
}

TEST(JoinPageTest, AListShowsNamesAndNoAccounts) {
  v1::Instance instance;
  instance.set_id("inst-7");
  instance.set_scene_name("plaza");
  instance.set_state(v1::INSTANCE_STATE_WAITING_FOR_PLAYERS);
  instance.set_regions(4);
  instance.set_players(2);
  instance.set_expected_players(3);
  for (const char* name : {"ada", "", "gone"}) {
    v1::Player& player = *instance.add_player_list();
    player.set_number(static_cast<std::uint32_t>(instance.player_list_size()));
    player.set_name(name);
    player.set_player_id("account");
    player.set_left(std::string(name) == "gone");
  }
  const PageAnswer answer = ListAnswer({instance});
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.body,
            R"({"instances":[{"expected_players":3,"game":"","id":"inst-7","names":["ada","player 2"],"players":2,)"
            R"("regions":4,"scene":"plaza","state":4}]})");
  EXPECT_EQ(ListAnswer({}).body, R"({"instances":[]})");
  EXPECT_TRUE(CheckListBody("{}").ok());
  EXPECT_EQ(CheckListBody(R"({"page": 1})").message(), "page: is not a field of this request");
  EXPECT_EQ(CheckListBody("[]").message(), "body: is not a JSON object");
}

TEST(JoinPageTest, AnAnswerThatNoClientCouldUseIsNoGrant) {
  v1::JoinInstanceResponse response = JoinedOnTwoRegions();
  response.mutable_regions()->RemoveLast();
  EXPECT_EQ(JoinAnswer("inst-7", response).status, 500);
}

TEST(JoinPageTest, ErrorsHaveAStatusAndTheField) {
  const auto of = [](const absl::Status& status) { return ErrorAnswer(status); };
  EXPECT_EQ(of(absl::InvalidArgumentError("player_name: bad")).body,
            R"({"code":"INVALID_ARGUMENT","error":"player_name: bad","field":"name"})");
  EXPECT_EQ(of(absl::NotFoundError("instance_id: no instance inst-7")).status, 404);
  EXPECT_EQ(of(absl::UnauthenticatedError("ticket: forged")).status, 401);
  EXPECT_EQ(of(absl::PermissionDeniedError("player: is banned: x")).status, 403);
  EXPECT_EQ(of(absl::AbortedError("be nice")).body, R"({"code":"ABORTED","error":"be nice"})");
  EXPECT_EQ(of(absl::ResourceExhaustedError("full")).status, 503);
  const PageAnswer early =
      of(WithRetryAfter(absl::ResourceExhaustedError("too many guests"), std::chrono::milliseconds(1'200)));
  EXPECT_EQ(early.status, 429);
  EXPECT_EQ(early.retry_after_s, 2) << "whole seconds, as the header has them";
  EXPECT_NE(early.body.find("\"retry_after_s\":2"), std::string::npos) << early.body;
  EXPECT_EQ(of(absl::InternalError("\xff")).body, R"({"code":"INTERNAL","error":"?"})");
}

}  // namespace
}  // namespace tessera::control
