// Each kind of attacker shows all that it has in hand as a ticket.
#include "control_plane/cluster/tickets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "control_plane/control_settings.h"
#include "control_plane/testing/fake_backend.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;
using namespace std::chrono_literals;

class TicketsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto added = issuers_.Add(game_.Registration("game"), rig_.now);
    ASSERT_TRUE(added.ok()) << added.status();
    game_.SetCluster(added->cluster_id());
    stranger_.SetCluster(added->cluster_id());
    records::Instance next = instance_.record;
    v1::Property& team = *next.add_properties();
    team.set_name("team");
    team.set_text("none");
    ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  }
  // Checked and used, as a join does.
  absl::Status Show(const std::string& text) {
    const auto ticket = tickets_.Check(text, instance_.record, rig_.now);
    return ticket.ok() ? tickets_.Use(*ticket, rig_.now) : ticket.status();
  }
  void ExpectRefused(const std::string& text, const std::string& why) {
    const absl::Status status = Show(text);
    EXPECT_EQ(status.code(), absl::StatusCode::kUnauthenticated) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("ticket: "));
    EXPECT_THAT(std::string(status.message()), HasSubstr(why));
  }

  StateRig rig_;
  HostEntry& alpha_ = rig_.AddHost("alpha");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_});
  Issuers issuers_{*rig_.state, SystemRandomBytes};
  Tickets tickets_{*rig_.state, issuers_};
  FakeBackend game_{1}, stranger_{2};
};

TEST_F(TicketsTest, OneThatCountsSaysWhoItIs) {
  trust::Ticket made = game_.Make("ada", rig_.now);
  made.instance = instance_.record.id();
  made.properties = {{"team", std::string("red")}};
  const auto ticket = tickets_.Check(game_.Sign(made), instance_.record, rig_.now);
  ASSERT_TRUE(ticket.ok()) << ticket.status();
  EXPECT_EQ(ticket->player_id, "ada");
  EXPECT_EQ(ticket->properties, made.properties);
  EXPECT_TRUE(tickets_.Use(*ticket, rig_.now).ok());
}

TEST_F(TicketsTest, ACopyIsRefusedAndSoIsAnOlderOne) {
  const std::string first = game_.MakeText("ada", rig_.now), second = game_.MakeText("ada", rig_.now);
  EXPECT_TRUE(Show(second).ok());
  ExpectRefused(second, "it was used");
  ExpectRefused(first, "it was used, or a newer one of its player was");
  EXPECT_TRUE(Show(game_.MakeText("bob", rig_.now)).ok()) << "another player's number is another";
  EXPECT_TRUE(Show(game_.MakeText("ada", rig_.now)).ok());
}

// Two joins may have checked the one ticket before either used it.
TEST_F(TicketsTest, OfTwoThatCheckOneTicketOneUsesIt) {
  const std::string text = game_.MakeText("ada", rig_.now);
  const auto first = tickets_.Check(text, instance_.record, rig_.now);
  const auto second = tickets_.Check(text, instance_.record, rig_.now);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_TRUE(tickets_.Use(*first, rig_.now).ok());
  EXPECT_EQ(tickets_.Use(*second, rig_.now).code(), absl::StatusCode::kUnauthenticated);
}

TEST_F(TicketsTest, ACopyIsRefusedByTheNextLifeOfTheControlPlane) {
  const std::string text = game_.MakeText("ada", rig_.now);
  ASSERT_TRUE(Show(text).ok());
  Tickets next{*rig_.state, issuers_};
  ASSERT_TRUE(next.Load(rig_.now).ok());
  EXPECT_EQ(next.Check(text, instance_.record, rig_.now).status().code(), absl::StatusCode::kUnauthenticated);
}

TEST_F(TicketsTest, WhatCannotBeStoredIsNotUsed) {
  const std::string text = game_.MakeText("ada", rig_.now);
  rig_.store.FailNext(1);
  EXPECT_EQ(Show(text).code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(Show(text).ok());
}

TEST_F(TicketsTest, YesterdaysIsRefused) {
  const std::string text = game_.MakeText("ada", rig_.now);
  rig_.Pass(24h);
  ExpectRefused(text, "ran out");
}

TEST_F(TicketsTest, TomorrowsIsRefused) {
  Now later = rig_.now;
  later.unix_time += 24h;
  ExpectRefused(game_.MakeText("ada", later), "in the future");
}

TEST_F(TicketsTest, AnotherClustersIsRefused) {
  trust::Ticket ticket = game_.Make("ada", rig_.now);
  ticket.cluster[0] ^= 1;
  ExpectRefused(game_.Sign(ticket), "it is for another cluster");
}

TEST_F(TicketsTest, AnotherInstancesIsRefused) {
  trust::Ticket ticket = game_.Make("ada", rig_.now);
  ticket.instance = "inst-99";
  ExpectRefused(game_.Sign(ticket), "it is for instance inst-99, this is " + instance_.record.id());
}

TEST_F(TicketsTest, AForgedOneIsRefused) {
  ExpectRefused(stranger_.MakeText("ada", rig_.now), "no issuer of this cluster has its key");
  // With the issuer's key id in it, and a signature of somebody else's.
  const auto own = trust::ParseTicket(stranger_.MakeText("ada", rig_.now));
  std::vector<std::uint8_t> bytes = own->body;
  const trust::TicketKeyId id = trust::KeyIdOf(trust::PublicKeyOf(game_.seed));
  std::copy(id.begin(), id.end(), bytes.begin() + 1);
  bytes.insert(bytes.end(), own->signature.begin(), own->signature.end());
  constexpr int kVariant = sodium_base64_VARIANT_URLSAFE_NO_PADDING;
  std::string text(sodium_base64_encoded_len(bytes.size(), kVariant), '\0');
  sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(), kVariant);
  text.pop_back();
  ExpectRefused(text, "issuer game has not signed it");
}

TEST_F(TicketsTest, AStrippedOneIsRefused) {
  const std::string text = game_.MakeText("ada", rig_.now);
  EXPECT_FALSE(Show(text.substr(0, text.size() - 86)).ok()) << "without its signature";
  EXPECT_FALSE(Show(text.substr(0, text.size() - 4)).ok());
  EXPECT_FALSE(Show("").ok());
  EXPECT_EQ(tickets_.remembered(), 0U);
}

TEST_F(TicketsTest, ARemovedIssuersIsRefused) {
  const std::string text = game_.MakeText("ada", rig_.now);
  v1::RemoveIssuerRequest remove;
  remove.set_name("game");
  ASSERT_TRUE(issuers_.Remove(remove).ok());
  ExpectRefused(text, "no issuer of this cluster has its key");
}

TEST_F(TicketsTest, AnIssuerSignsForItsInstancesAlone) {
  FakeBackend narrow{3};
  const auto added = issuers_.Add(narrow.Registration("narrow", "inst-99"), rig_.now);
  ASSERT_TRUE(added.ok()) << added.status();
  narrow.SetCluster(added->cluster_id());
  ExpectRefused(narrow.MakeText("ada", rig_.now), "issuer narrow signs for the instances inst-99 alone");
  // One issuer's numbers are not another's: it cannot use up a player's tickets of another game.
  EXPECT_TRUE(Show(game_.MakeText("ada", rig_.now)).ok());
}

TEST_F(TicketsTest, PropertiesAreThoseThatTheSceneDeclares) {
  trust::Ticket ticket = game_.Make("ada", rig_.now);
  ticket.properties = {{"mana", std::int64_t{1}}};
  EXPECT_THAT(std::string(Show(game_.Sign(ticket)).message()), HasSubstr("ticket: properties: no property \"mana\""));
  ticket.properties = {{"team", std::int64_t{1}}};
  const absl::Status status = Show(game_.Sign(ticket));
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("ticket: properties: "));
}

TEST_F(TicketsTest, NumbersAreForgottenOnceEveryCopyHasRunOut) {
  const std::string text = game_.MakeText("ada", rig_.now);
  ASSERT_TRUE(Show(text).ok());
  ASSERT_TRUE(Show(game_.MakeText("ada", rig_.now)).ok());
  ASSERT_TRUE(Show(game_.MakeText("bob", rig_.now)).ok());
  rig_.Pass(kTicketMemory - 1s);
  ASSERT_TRUE(Show(game_.MakeText("bob", rig_.now)).ok());
  tickets_.Prune(rig_.now);
  EXPECT_EQ(tickets_.remembered(), 2U);
  rig_.Pass(1s);
  rig_.store.FailNext(1);
  tickets_.Prune(rig_.now);
  EXPECT_EQ(tickets_.remembered(), 2U);
  tickets_.Prune(rig_.now);
  EXPECT_EQ(tickets_.remembered(), 1U) << "bob's was shown later";
  ExpectRefused(text, "ran out");
  Tickets next{*rig_.state, issuers_};
  ASSERT_TRUE(next.Load(rig_.now).ok());
  EXPECT_EQ(next.remembered(), 1U);
}

}  // namespace
}  // namespace tessera::control
