// A client says to a door what it should, and takes good answers and refuses bad ones.
#include "client_sdk/connect/door_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <nlohmann/json.hpp>

#include "absl/strings/escaping.h"
#include "client_sdk/testing/fake_door.h"
#include "core/world/viewer_number.h"
#include "host/temporary_folder.h"

namespace tessera::client {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using Json = nlohmann::json;

constexpr std::chrono::seconds kSessionPatience{20};

struct DoorSessionTest : testing::Test {
  DoorSessionTest() {
    door =
        std::make_unique<FakeDoor>(folder.path() + "/c.json", [this](const std::string& path, const std::string& text) {
          asked_path = path;
          asked = Json::parse(text, nullptr, false);
          return FakeDoor::Http(status, answer);
        });
    doors.push_back(*ParseDoorAddress("unix:" + folder.path() + "/c"));
  }
  absl::StatusOr<std::vector<std::uint8_t>> Join(bool watch = false) {
    return JoinByDoor(doors, {.instance_id = "inst-7",
                              .player_name = "ada",
                              .ticket = {},
                              .returning = {},
                              .watch = watch,
                              .deadline = kSessionPatience});
  }
  std::string JoinFault(int with, const std::string& text, bool watch = false) {
    status = with;
    answer = text;
    return std::string(Join(watch).status().message());
  }
  absl::StatusCode CodeFor(int with, const std::string& text) {
    status = with;
    answer = text;
    return Join().status().code();
  }
  std::string ListFault(const std::string& text) {
    answer = text;
    return std::string(ListByDoor(doors, kSessionPatience).status().message());
  }

  host::TemporaryFolder folder;
  std::vector<DoorAddress> doors;
  int status = 200;
  std::string answer = R"({"grant": "AQID", "instance": "inst-7", "player": 3})", asked_path;
  Json asked;
  std::unique_ptr<FakeDoor> door;  // ends before what it uses
};

TEST_F(DoorSessionTest, AGuestJoinsByName) {
  const auto grant = Join();
  ASSERT_TRUE(grant.ok()) << grant.status();
  EXPECT_THAT(*grant, ElementsAre(1, 2, 3));
  EXPECT_EQ(asked_path, "/v1/join");
  EXPECT_EQ(asked, Json({{"instance", "inst-7"}, {"name", "ada"}}));
}

TEST_F(DoorSessionTest, ATicketOrAReturnTokenGoesAsItIs) {
  ASSERT_TRUE(
      JoinByDoor(
          doors,
          {.instance_id = "inst-7", .player_name = {}, .ticket = "AVZH", .returning = {}, .deadline = kSessionPatience})
          .ok());
  EXPECT_EQ(asked, Json({{"instance", "inst-7"}, {"ticket", "AVZH"}}));
  const std::vector<std::uint8_t> token(100, 0xfb);
  ASSERT_TRUE(
      JoinByDoor(
          doors,
          {.instance_id = "inst-7", .player_name = {}, .ticket = {}, .returning = token, .deadline = kSessionPatience})
          .ok());
  std::string bytes;
  ASSERT_TRUE(absl::Base64Unescape(asked.at("returning").get<std::string>(), &bytes));
  EXPECT_EQ(bytes, std::string(100, '\xfb'));
  answer = "{}";
  ASSERT_TRUE(LeaveByDoor(doors, "inst-7", token, kSessionPatience).ok());
  EXPECT_EQ(asked_path, "/v1/leave");
  EXPECT_EQ(asked.at("instance"), "inst-7");
  ASSERT_TRUE(absl::Base64Unescape(asked.at("returning").get<std::string>(), &bytes));
  EXPECT_EQ(bytes, std::string(100, '\xfb'));
}

TEST_F(DoorSessionTest, WhatATicketExcludesIsRefusedBeforeAnybodyIsAsked) {
  const std::vector<std::uint8_t> token(100), shorter(32);
  const auto fault = [&](const DoorJoin& join) { return std::string(JoinByDoor(doors, join).status().message()); };
  EXPECT_EQ(fault({.instance_id = "a", .player_name = "ada", .ticket = "AVZH", .returning = {}}),
            "player_name: the ticket says the name; leave it empty");
  EXPECT_EQ(fault({.instance_id = "a", .player_name = {}, .ticket = "AVZH", .returning = token}),
            "returning: the ticket says who comes back; leave it empty");
  EXPECT_EQ(fault({.instance_id = "a", .player_name = {}, .ticket = {}, .returning = shorter}),
            "returning: is no return token");
  EXPECT_EQ(door->requests(), 0);
}

TEST_F(DoorSessionTest, AViewerIsNoPlayer) {
  EXPECT_THAT(JoinFault(200, answer, true), HasSubstr("player 3: no viewer"));
  EXPECT_EQ(asked.at("viewer"), true);
  const std::string viewer = std::to_string(kFirstViewer + 5);
  EXPECT_EQ(JoinFault(200, R"({"grant": "AQID", "player": )" + viewer + "}"),
            "the control plane's answer: player " + viewer + ": a viewer");
  EXPECT_TRUE(Join(true).ok());
}

TEST_F(DoorSessionTest, ABadAnswerNamesItsField) {
  const std::string answered = "the control plane's answer: ";
  for (const char* none : {"", "{", "[]", "\"text\"", "\xff\xfe", "<html>"}) {
    EXPECT_EQ(JoinFault(200, none), answered + "is not a JSON object") << none;
  }
  EXPECT_EQ(JoinFault(200, std::string(100'000, '[')), answered + "is not a JSON object");
  EXPECT_EQ(JoinFault(200, "{}"), answered + "player: is no number");
  EXPECT_EQ(JoinFault(200, R"({"player": -1})"), answered + "player: is no number");
  EXPECT_EQ(JoinFault(200, R"({"player": 0})"), answered + "player 0");
  EXPECT_EQ(JoinFault(200, R"({"player": 4294967296})"), answered + "player 4294967296");
  EXPECT_EQ(JoinFault(200, R"({"player": 3})"), answered + "grant: is no text");
  EXPECT_EQ(JoinFault(200, R"({"player": 3, "grant": 7})"), answered + "grant: is no text");
  EXPECT_EQ(JoinFault(200, R"({"player": 3, "grant": "?"})"), answered + "grant: is not base64");
  EXPECT_THAT(JoinFault(200, R"({"player": 3, "grant": ")" + std::string(1'400'000, 'A') + "\"}"),
              StartsWith(answered + "grant: has 1050000 bytes"));
  EXPECT_EQ(CodeFor(200, "{"), absl::StatusCode::kInternal);
}

TEST_F(DoorSessionTest, WhatTheDoorSaysComesWithItsCodeAndField) {
  EXPECT_EQ(JoinFault(404, R"({"code":"NOT_FOUND","error":"instance_id: no instance","field":"instance"})"),
            "instance inst-7: no such instance");
  EXPECT_EQ(JoinFault(401, R"({"code":"UNAUTHENTICATED","error":"ticket: ran out 31 s ago","field":"ticket"})"),
            "instance inst-7: ticket: ran out 31 s ago");
  using Code = absl::StatusCode;
  EXPECT_EQ(CodeFor(404, R"({"code":"NOT_FOUND","error":"instance_id: no instance","field":"instance"})"),
            Code::kNotFound);
  EXPECT_EQ(CodeFor(503, R"({"code":"RESOURCE_EXHAUSTED","error":"full: 64 players"})"), Code::kResourceExhausted);
  EXPECT_EQ(CodeFor(409, R"({"code":"ABORTED","error":"be nice"})"), Code::kAborted);
  // A door of an earlier release says no code.
  EXPECT_EQ(CodeFor(401, R"({"error":"ticket: forged"})"), Code::kUnauthenticated);
  EXPECT_EQ(CodeFor(403, R"({"error":"player: is banned"})"), Code::kPermissionDenied);
  EXPECT_EQ(CodeFor(409, R"({"error":"be nice"})"), Code::kFailedPrecondition);
  EXPECT_EQ(CodeFor(503, R"({"error":"full"})"), Code::kUnavailable);
  EXPECT_EQ(CodeFor(500, R"({"error":"?"})"), Code::kInternal);
}

TEST_F(DoorSessionTest, AnErrorThatIsNotTheDoorsOwnSaysWhoAnswered) {
  const std::string who = "control plane at unix:" + folder.path() + "/c: answers with HTTP status ";
  EXPECT_EQ(JoinFault(404, "<html>"), who + "404");
  EXPECT_EQ(JoinFault(401, "{}"), who + "401");
  EXPECT_EQ(JoinFault(503, ""), who + "503");
  EXPECT_EQ(JoinFault(204, ""), who + "204");
  EXPECT_EQ(CodeFor(404, "<html>"), absl::StatusCode::kUnavailable);
  EXPECT_EQ(CodeFor(504, "<html>"), absl::StatusCode::kDeadlineExceeded);
  // No page of any length becomes an error's text.
  EXPECT_LT(JoinFault(503, R"({"error":")" + std::string(100'000, 'x') + "\"}").size(), 1100U);
}

TEST_F(DoorSessionTest, AListIsReadWithinItsBounds) {
  const Json one{{"id", "inst-7"},
                 {"scene", std::string(500, 's')},
                 {"game", ""},
                 {"state", 4},
                 {"regions", 2},
                 {"players", 3},
                 {"expected_players", 4},
                 {"names", std::vector<std::string>(20, "ada")}};
  answer = Json{{"instances", std::vector<Json>(300, one)}}.dump();
  const auto listed = ListByDoor(doors, kSessionPatience);
  ASSERT_TRUE(listed.ok()) << listed.status();
  EXPECT_EQ(asked_path, "/v1/instances");
  EXPECT_EQ(asked, Json::object());
  ASSERT_EQ(listed->size(), kMostDoorInstances);
  EXPECT_EQ(listed->front().id, "inst-7");
  EXPECT_EQ(listed->front().scene, std::string(63, 's'));
  EXPECT_EQ(listed->front().state, 4);
  EXPECT_EQ(listed->front().players, 3U);
  EXPECT_EQ(listed->front().names.size(), kMostDoorNames);
}

TEST_F(DoorSessionTest, AListThatIsNoneNamesTheField) {
  const std::string answered = "the control plane's answer: ";
  const auto with = [](const char* field, Json value) {
    Json one{
        {"id", "inst-7"},        {"scene", ""},           {"game", ""}, {"state", 4}, {"regions", 2}, {"players", 3},
        {"expected_players", 4}, {"names", Json::array()}};
    one[field] = std::move(value);
    return Json{{"instances", {one}}}.dump();
  };
  EXPECT_EQ(ListFault("{}"), answered + "instances: is no list");
  EXPECT_EQ(ListFault(R"({"instances": [7]})"), answered + "instances: holds what is no object");
  EXPECT_EQ(ListFault(with("id", 7)), answered + "instances.id: is no text");
  EXPECT_EQ(ListFault(with("state", 256)), answered + "instances.state: is no number up to 255");
  EXPECT_EQ(ListFault(with("players", -1)), answered + "instances.players: is no number up to 4294967295");
  EXPECT_EQ(ListFault(with("names", "ada")), answered + "instances.names: is no list");
  EXPECT_EQ(ListFault(with("names", {7})), answered + "instances.names: holds what is no text");
  status = 503;
  EXPECT_EQ(ListFault(R"({"code":"UNAVAILABLE","error":"not recovered"})"),
            "control plane at unix:" + folder.path() + "/c: not recovered");
}

// Several control planes: the last one is that of the other tests.
struct DoorListTest : DoorSessionTest {
  // One more, asked before those that are there.
  FakeDoor& First(const std::string& name, FakeDoor::Answerer answerer) {
    others.push_back(std::make_unique<FakeDoor>(folder.path() + "/" + name + ".json", std::move(answerer)));
    doors.insert(doors.begin(), *ParseDoorAddress(Name(name)));
    return *others.back();
  }
  void FirstIsNobody(const std::string& name) { doors.insert(doors.begin(), *ParseDoorAddress(Name(name))); }
  // Takes connections and says nothing, as what stands still does, until the end of the test.
  std::string FirstIsSilent() {
    others.push_back(std::make_unique<FakeDoor>(
        [waited = over.get_future().share()](int) -> FakeDoor::Stream {
          waited.wait();
          return {};
        },
        FakeDoor::Answerer()));
    doors.insert(doors.begin(), *ParseDoorAddress(others.back()->address()));
    return others.back()->address();
  }
  std::string Name(const std::string& name) const { return "unix:" + folder.path() + "/" + name; }
  static FakeDoor::Answerer Always(int status, const std::string& answer) {
    return [=](const std::string&, const std::string&) { return FakeDoor::Http(status, answer); };
  }

  std::promise<void> over;
  std::vector<std::unique_ptr<FakeDoor>> others;
};

TEST_F(DoorListTest, TheNextIsAskedWhereNobodyIs) {
  FirstIsNobody("a");
  const auto grant = Join();
  ASSERT_TRUE(grant.ok()) << grant.status();
  EXPECT_THAT(*grant, ElementsAre(1, 2, 3));
  answer = R"({"instances": []})";
  EXPECT_TRUE(ListByDoor(doors, kSessionPatience).ok());
  answer = "{}";
  EXPECT_TRUE(LeaveByDoor(doors, "inst-7", std::vector<std::uint8_t>(100), kSessionPatience).ok());
  EXPECT_EQ(door->requests(), 3);
}

TEST_F(DoorListTest, TheNextIsAskedWhereADoorCannotServe) {
  const FakeDoor& follows = First("a", Always(503, R"({"code":"UNAVAILABLE","error":"not recovered"})"));
  EXPECT_TRUE(Join().ok());
  EXPECT_EQ(follows.requests(), 1);
  // In front of it may stand something else.
  const FakeDoor& before_it = First("b", Always(502, "<html>"));
  EXPECT_TRUE(Join().ok());
  EXPECT_EQ(before_it.requests(), 1);
}

TEST_F(DoorListTest, TheNextIsAskedWhereOneIsSilent) {
  FirstIsSilent();
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_TRUE(Join().ok());
  EXPECT_GE(std::chrono::steady_clock::now() - begun, kReachPatience);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, kSessionPatience);
  over.set_value();
}

TEST_F(DoorListTest, WhereNoneServesTheErrorSaysWhyOfEach) {
  First("a", Always(503, R"({"code":"UNAVAILABLE","error":"not recovered"})"));
  FirstIsNobody("b");
  const std::string names = Name("b") + ", " + Name("a") + ", " + Name("c");
  EXPECT_THAT(JoinFault(503, "<html>"), StartsWith("no control plane of " + names + " serves: " + Name("b") + ": "));
  EXPECT_THAT(JoinFault(503, "<html>"), HasSubstr("; " + Name("a") + ": instance inst-7: not recovered; " + Name("c") +
                                                  ": answers with HTTP status 503"));
  EXPECT_EQ(CodeFor(503, "<html>"), absl::StatusCode::kUnavailable);
}

TEST_F(DoorListTest, WhoeverLeadsHasTheLastWord) {
  const FakeDoor& leads = First("a", Always(404, R"({"code":"NOT_FOUND","error":"no","field":"instance"})"));
  EXPECT_EQ(JoinFault(200, answer), "instance inst-7: no such instance");
  const FakeDoor& full = First("b", Always(503, R"({"code":"RESOURCE_EXHAUSTED","error":"full: 64 players"})"));
  EXPECT_EQ(CodeFor(200, answer), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(leads.requests(), 1);
  EXPECT_EQ(full.requests(), 1);
  EXPECT_EQ(door->requests(), 0);
}

TEST_F(DoorListTest, ARequestThatMayHaveBeenCarriedOutIsNotMadeAgain) {
  First("a", [](const std::string&, const std::string&) { return std::string(); });
  EXPECT_EQ(Join().status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(door->requests(), 0);
}

TEST_F(DoorListTest, OneDeadlineIsForAll) {
  doors.clear();
  const std::string silent = FirstIsSilent();
  doors.push_back(doors.front());
  const auto begun = std::chrono::steady_clock::now();
  const auto listed = ListByDoor(doors, std::chrono::milliseconds(100));
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(10));
  over.set_value();
  EXPECT_EQ(listed.status().code(), absl::StatusCode::kDeadlineExceeded) << listed.status();
  const std::string error(listed.status().message());
  EXPECT_THAT(error, StartsWith("no control plane of " + silent + ", " + silent + " serves: " + silent + ": "));
  EXPECT_THAT(error, EndsWith("; " + silent + ": no answer"));
}

TEST_F(DoorSessionTest, EveryCallEndsByItsDeadline) {
  std::promise<void> over;
  door.reset();
  unlink((folder.path() + "/c.json").c_str());
  door = std::make_unique<FakeDoor>(folder.path() + "/c.json",
                                    [waited = over.get_future().share()](const std::string&, const std::string&) {
                                      waited.wait();
                                      return std::string();
                                    });
  constexpr std::chrono::milliseconds kShort{50};
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_EQ(
      JoinByDoor(doors, {.instance_id = "a", .player_name = {}, .ticket = {}, .returning = {}, .deadline = kShort})
          .status()
          .code(),
      absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(LeaveByDoor(doors, "a", {}, kShort).code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(ListByDoor(doors, kShort).status().code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(10));
  over.set_value();
}

}  // namespace
}  // namespace tessera::client
