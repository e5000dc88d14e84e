// Players with tickets, guests, and who is sent away, under a virtual clock.
#include <gmock/gmock.h>

#include <algorithm>
#include <optional>
#include <string>

#include "control_plane/retry_after.h"
#include "control_plane/testing/cluster_harness.h"
#include "control_plane/testing/fake_backend.h"
#include "core/world/limits.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;

class ClusterPlayersTest : public ::testing::Test {
 protected:
  void SetUp() override {
    harness_.AddHost("alpha", 8);
    const auto added = harness_.cluster().AddIssuer(harness_.now, game_.Registration("game"));
    ASSERT_TRUE(added.ok()) << added.status();
    game_.SetCluster(added->cluster_id());
    id_ = Running(false);
  }
  std::string Running(bool guests, std::uint32_t max_players = kUsualPlayers) {
    InstancePlan plan = TestPlan(2);
    plan.max_players = max_players;
    plan.properties.emplace_back().set_name("team");
    plan.properties.back().set_text("none");
    plan.guests = guests;
    const std::string id = Create(harness_, plan);
    harness_.Pump();
    harness_.Pump();
    EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
    return id;
  }
  // As the doors do.
  absl::StatusOr<struct Joined> Join(const v1::JoinInstanceRequest& request) {
    const auto ticket = harness_.cluster().TakeTicket(harness_.now, request, address_);
    if (!ticket.ok()) return ticket.status();
    return harness_.cluster().Join(harness_.now, request, *ticket);
  }
  absl::StatusOr<struct Joined> Join(const std::string& id, const std::string& text) {
    v1::JoinInstanceRequest request;
    request.set_instance_id(id);
    request.set_ticket(text);
    return Join(request);
  }
  absl::StatusOr<struct Joined> JoinAs(const std::string& id, const std::string& player) {
    return Join(id, game_.MakeText(player, harness_.now));
  }
  v1::Player PlayerAt(const std::string& id, int place) { return harness_.Get(id).player_list(place); }
  absl::Status Kick(std::uint32_t number, const std::string& reason) {
    v1::KickPlayerRequest request;
    request.set_id(id_);
    request.set_number(number);
    request.set_reason(reason);
    return harness_.cluster().KickPlayer(harness_.now, request).status();
  }
  absl::Status Ban(const std::string& id, const std::string& player, const std::string& reason) {
    v1::BanPlayerRequest request;
    request.set_id(id);
    request.set_player_id(player);
    request.set_reason(reason);
    return harness_.cluster().BanPlayer(harness_.now, request).status();
  }
  void Connect(std::uint32_t number) {
    for (auto& [name, agent] : harness_.agents) {
      for (auto& [key, worker] : agent.fake.workers) worker.report.add_connected_players(number);
    }
  }

  ClusterHarness harness_;
  FakeBackend game_{1};
  std::string id_, address_;  // the address: from which strangers come, "" where it is not known
};

TEST_F(ClusterPlayersTest, ATicketsNameIdAndPropertiesAreThePlayers) {
  const auto joined = JoinAs(id_, "ada");
  ASSERT_TRUE(joined.ok()) << joined.status();
  EXPECT_EQ(PlayerAt(id_, 0).name(), "name of ada");
  EXPECT_EQ(PlayerAt(id_, 0).player_id(), "ada");
  harness_.Pump();
  const v1::WorkerOrder& order = harness_.agents.at("alpha").fake.workers.at({id_, 1}).order;
  EXPECT_EQ(order.players(0).name(), "name of ada");
  EXPECT_TRUE(order.players(0).player_id().empty()) << "hosts need not know who plays";
}

TEST_F(ClusterPlayersTest, PropertiesGoToTheRegionThatMakesTheBodyAlone) {
  trust::Ticket ticket = game_.Make("ada", harness_.now);
  ticket.properties = {{"team", std::string("red")}};
  ASSERT_TRUE(Join(id_, game_.Sign(ticket)).ok());
  harness_.Pump();
  const auto player_in = [&](std::uint32_t region) {
    return harness_.agents.at("alpha").fake.workers.at({id_, region}).order.players(0);
  };
  const std::uint32_t maker = PlayerAt(id_, 0).spawn_region();
  ASSERT_EQ(player_in(maker).properties_size(), 1);
  EXPECT_EQ(player_in(maker).properties(0).text(), "red");
  EXPECT_EQ(player_in(3 - maker).properties_size(), 0);
}

// A host may run many regions of one instance, and their orders are one message.
TEST_F(ClusterPlayersTest, AFullInstancesOrdersAreBounded) {
  id_ = Running(false, kMaxPlayers);
  std::size_t written = 0;
  for (std::uint32_t i = 0; i < kMaxPlayers; ++i) {
    const std::size_t before = harness_.store.bytes_written();
    trust::Ticket ticket = game_.Make(std::string(60, 'p') + std::to_string(i), harness_.now);
    ticket.player_id.resize(trust::kMaxTicketPlayerId, 'p');
    ticket.name = std::string(32, 'n');
    ticket.properties = {{"team", std::string(63, 'v')}};
    ASSERT_TRUE(Join(id_, game_.Sign(ticket)).ok()) << i;
    written = harness_.store.bytes_written() - before;
  }
  EXPECT_LT(written, 400 * kMaxPlayers / Players::kBuckets) << "the last one has not written all others anew";
  const std::string one_more = game_.MakeText("one more", harness_.now);
  const absl::Status full = Join(id_, one_more).status();
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted) << full;
  EXPECT_TRUE(Join(Running(false), one_more).ok()) << "it was not used";
  trust::Ticket back = game_.Make("ada", harness_.now);
  back.player_id = PlayerAt(id_, 0).player_id();
  EXPECT_TRUE(Join(id_, game_.Sign(back)).ok()) << "who is there has a place";
  harness_.Pump();
  const auto& workers = harness_.agents.at("alpha").fake.workers;
  const std::size_t one = workers.at({id_, 1}).order.ByteSizeLong(), other = workers.at({id_, 2}).order.ByteSizeLong();
  EXPECT_LT(one + other, 160U * kMaxPlayers) << "a name and properties are in the order of one region";
  EXPECT_LT(harness_.cluster().state().FindInstance(id_)->record.ByteSizeLong(), 4096U);
}

TEST_F(ClusterPlayersTest, APlayerComesBackByANewTicketAsTheSame) {
  const auto first = JoinAs(id_, "ada");
  ASSERT_TRUE(first.ok()) << first.status();
  ASSERT_TRUE(JoinAs(id_, "bob").ok());
  harness_.Restart();
  harness_.Pump();
  const auto second = JoinAs(id_, "ada");
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->response.player(), first->response.player());
  EXPECT_EQ(PlayerAt(id_, 0).generation(), 2U) << "the regions end the older process";
  EXPECT_EQ(harness_.Get(id_).player_list_size(), 2);
}

// The same copy, after the control plane was killed between the ticket's use and the join.
TEST_F(ClusterPlayersTest, ACopiedTicketJoinsNobodyWhateverDied) {
  const std::string text = game_.MakeText("ada", harness_.now);
  v1::JoinInstanceRequest request;
  request.set_instance_id(id_);
  request.set_ticket(text);
  ASSERT_TRUE(harness_.cluster().TakeTicket(harness_.now, request, address_).ok());
  harness_.Restart();
  harness_.Pump();
  EXPECT_EQ(Join(id_, text).status().code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(harness_.Get(id_).player_list_size(), 0);
  const std::string other = Running(false);
  EXPECT_EQ(Join(other, text).status().code(), absl::StatusCode::kUnauthenticated) << "nor anywhere else";
}

// A caller that goes past TakeTicket gets nothing for the text alone.
TEST_F(ClusterPlayersTest, ATicketThatNobodyCheckedJoinsNobody) {
  v1::JoinInstanceRequest request;
  request.set_instance_id(id_);
  request.set_ticket(game_.MakeText("ada", harness_.now));
  EXPECT_EQ(harness_.cluster().Join(harness_.now, request).status().code(), absl::StatusCode::kInternal);
}

TEST_F(ClusterPlayersTest, AnInstanceWithoutGuestsRefusesThem) {
  const absl::Status refused = Join(JoinRequest(id_)).status();
  EXPECT_EQ(refused, absl::UnauthenticatedError("ticket: this instance takes no guests: a ticket is needed"));
  EXPECT_FALSE(harness_.Get(id_).guests());
  v1::JoinInstanceRequest watch;
  watch.set_instance_id(id_);
  watch.set_viewer(true);
  EXPECT_EQ(harness_.cluster().TakeTicket(harness_.now, watch, address_).status().code(),
            absl::StatusCode::kUnauthenticated);
  EXPECT_TRUE(harness_.cluster().TakeTicket(harness_.now, watch, std::nullopt).ok()) << "an operator's page watches";
  const std::string open = Running(true);
  EXPECT_TRUE(harness_.Get(open).guests());
  EXPECT_TRUE(Join(JoinRequest(open)).ok());
  EXPECT_TRUE(JoinAs(open, "ada").ok()) << "guests and others play together";
}

TEST_F(ClusterPlayersTest, GuestsOfOneAddressJoinAtARateAndTicketsAndOthersAsBefore) {
  const GuestLimits limits = ControlSettings{}.guests;
  const std::string open = Running(true);
  address_ = "flood";
  for (int i = 0; i < static_cast<int>(limits.of_address.burst); ++i) ASSERT_TRUE(Join(JoinRequest(open)).ok()) << i;
  const absl::Status refused = Join(JoinRequest(open)).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  ASSERT_TRUE(RetryAfterOf(refused).has_value()) << refused;
  EXPECT_TRUE(JoinAs(open, "ada").ok()) << "who shows a ticket is known";
  address_ = "";
  const auto other = Join(JoinRequest(open));
  ASSERT_TRUE(other.ok()) << other.status();
  address_ = "flood";
  v1::JoinInstanceRequest back = JoinRequest(open, "");
  back.set_credential(other->response.credential());
  back.set_credential_key(other->response.credential_key());
  EXPECT_TRUE(Join(back).ok()) << "who comes back has a place";
  harness_.now.steady += *RetryAfterOf(refused);
  EXPECT_TRUE(Join(JoinRequest(open)).ok()) << "who waits as told comes in";
}

TEST_F(ClusterPlayersTest, AFloodOfGuestsFromEverywhereIsHeldToTheInstancesRate) {
  const GuestLimits limits = ControlSettings{}.guests;
  const std::string open = Running(true), other = Running(true);
  const int burst = static_cast<int>(limits.of_instance.burst);
  for (int i = 0; i < burst; ++i) {
    address_ = "address " + std::to_string(i);
    ASSERT_TRUE(Join(JoinRequest(open)).ok()) << i;
  }
  address_ = "one more";
  EXPECT_EQ(Join(JoinRequest(open)).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(Join(JoinRequest(other)).ok());
}

TEST_F(ClusterPlayersTest, ATicketSaysAllThatThereIsToSay) {
  v1::JoinInstanceRequest request = JoinRequest(id_, "not ada");
  request.set_ticket(game_.MakeText("ada", harness_.now));
  EXPECT_EQ(Join(request).status().code(), absl::StatusCode::kInvalidArgument);
  request.clear_player_name();
  EXPECT_TRUE(Join(request).ok()) << "a bad request uses no ticket up";
}

TEST_F(ClusterPlayersTest, WhoIsKickedIsToldWhyAndMayComeBackAsSomebodyNew) {
  const auto joined = JoinAs(id_, "ada");
  ASSERT_TRUE(joined.ok()) << joined.status();
  EXPECT_EQ(Kick(7, "x").code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Kick(1, "a\nb").code(), absl::StatusCode::kInvalidArgument);
  ASSERT_TRUE(Kick(1, "be nice").ok());
  EXPECT_EQ(Kick(1, "be nice").code(), absl::StatusCode::kNotFound);
  harness_.Pump();
  const v1::WorkerOrder& order = harness_.agents.at("alpha").fake.workers.at({id_, 1}).order;
  EXPECT_TRUE(order.players(0).left());
  EXPECT_EQ(order.players(0).ended_because(), "be nice") << "the regions tell the client so";
  v1::JoinInstanceRequest back;
  back.set_instance_id(id_);
  back.set_credential(joined->response.credential());
  back.set_credential_key(joined->response.credential_key());
  EXPECT_EQ(Join(back).status(), absl::AbortedError("be nice"));
  const auto again = JoinAs(id_, "ada");
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->response.player(), 2U);
}

TEST_F(ClusterPlayersTest, WhoIsBannedIsKickedAndLetInNoMoreUntilUnbanned) {
  ASSERT_TRUE(JoinAs(id_, "ada").ok());
  ASSERT_TRUE(Ban(id_, "ada", "cheats").ok());
  EXPECT_TRUE(PlayerAt(id_, 0).left());
  EXPECT_EQ(PlayerAt(id_, 0).ended_because(), "cheats");
  harness_.Restart();
  harness_.Pump();
  EXPECT_EQ(JoinAs(id_, "ada").status(), absl::PermissionDeniedError("player: is banned: cheats"));
  EXPECT_TRUE(JoinAs(Running(false), "ada").ok()) << "of that instance alone";
  v1::UnbanPlayerRequest unban;
  unban.set_id(id_);
  unban.set_player_id("ada");
  ASSERT_TRUE(harness_.cluster().UnbanPlayer(unban).ok());
  EXPECT_TRUE(JoinAs(id_, "ada").ok());
}

TEST_F(ClusterPlayersTest, ABanOfTheClusterEndsThePlayerEverywhere) {
  const std::string other = Running(false);
  ASSERT_TRUE(JoinAs(id_, "ada").ok());
  ASSERT_TRUE(JoinAs(other, "ada").ok());
  ASSERT_TRUE(Ban("", "ada", "").ok());
  EXPECT_TRUE(PlayerAt(id_, 0).left());
  EXPECT_TRUE(PlayerAt(other, 0).left());
  EXPECT_EQ(JoinAs(Running(false), "ada").status(),
            absl::PermissionDeniedError("player: is banned: banned by an operator"));
}

TEST_F(ClusterPlayersTest, ABanByNumberIsOfWhoHasAnId) {
  const std::string open = Running(true);
  ASSERT_TRUE(Join(JoinRequest(open)).ok());
  ASSERT_TRUE(JoinAs(open, "ada").ok());
  v1::BanPlayerRequest request;
  request.set_id(open);
  request.set_number(1);
  const absl::Status guest = harness_.cluster().BanPlayer(harness_.now, request).status();
  EXPECT_EQ(guest.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(guest.message()), HasSubstr("is a guest"));
  request.set_number(2);
  const auto banned = harness_.cluster().BanPlayer(harness_.now, request);
  ASSERT_TRUE(banned.ok()) << banned.status();
  EXPECT_EQ(banned->ban().player_id(), "ada");
  v1::ListBansRequest list;
  list.set_id(open);
  EXPECT_EQ(harness_.cluster().ListBans(list)->bans_size(), 1);
}

// The default policy keeps the bodies of those who vanish, but one who never came fills a place for nothing.
TEST_F(ClusterPlayersTest, WhoNeverConnectedIsLetGoAndWhoOnceDidStays) {
  harness_.agents.at("alpha").fake.connect_players = false;
  ASSERT_TRUE(JoinAs(id_, "ada").ok());
  ASSERT_TRUE(JoinAs(id_, "bob").ok());
  harness_.Pump();
  Connect(2);
  harness_.Run(seconds(1));
  for (auto& [key, worker] : harness_.agents.at("alpha").fake.workers) worker.report.clear_connected_players();
  harness_.Run(seconds(55));
  EXPECT_EQ(harness_.Get(id_).players(), 2U);
  harness_.Restart();
  harness_.Run(seconds(55));
  EXPECT_EQ(harness_.Get(id_).players(), 2U) << "a new life counts anew";
  harness_.Run(seconds(10));
  EXPECT_EQ(harness_.Get(id_).players(), 1U);
  EXPECT_TRUE(PlayerAt(id_, 0).left());
  EXPECT_FALSE(PlayerAt(id_, 1).left());
}

}  // namespace
}  // namespace tessera::control
