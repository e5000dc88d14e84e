// Tickets: the form, every limit, and what a thief or a forger makes of one.
#include "trust/ticket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sodium.h>

#include <cmath>
#include <limits>

#include "host/files.h"

namespace tessera::trust {
namespace {

using ::testing::HasSubstr;
using namespace std::chrono_literals;

TicketSeed SeedOf(std::uint8_t first) {
  TicketSeed seed{};
  for (std::size_t i = 0; i < seed.size(); ++i) seed[i] = static_cast<std::uint8_t>(first + i);
  return seed;
}

// The example of docs/tickets.md.
Ticket Example() {
  Ticket ticket;
  for (std::size_t i = 0; i < ticket.cluster.size(); ++i) ticket.cluster[i] = static_cast<std::uint8_t>(0x80 + i);
  ticket.issued_at = 1'700'000'000'000ms;
  ticket.lifetime = 300s;
  ticket.number = 42;
  ticket.instance = "inst-7";
  ticket.player_id = "ada@example";
  ticket.name = "Ada";
  ticket.properties = {{"armed", true}, {"score", std::int64_t{-3}}, {"pace", 1.5}, {"team", std::string("red")}};
  return ticket;
}

std::string WhyNot(const Ticket& ticket) { return std::string(SignTicket(ticket, SeedOf(0)).status().message()); }

// Another program, in another language, made the document's example.
TEST(TicketTest, TheDocumentsExampleIsWhatIsMadeHere) {
  const auto document = host::ReadFile(std::string(TESSERA_SOURCE_DIR) + "/docs/tickets.md", 1 << 20);
  ASSERT_TRUE(document.ok()) << document.status();
  const auto text = SignTicket(Example(), SeedOf(0));
  ASSERT_TRUE(text.ok()) << text.status();
  EXPECT_THAT(*document, HasSubstr("\n" + *text + "\n"));
}

TEST(TicketTest, WhatWasSignedIsReadBackAndVerifiesByItsKeyAlone) {
  const auto shown = ParseTicket(*SignTicket(Example(), SeedOf(0)));
  ASSERT_TRUE(shown.ok()) << shown.status();
  Ticket expected = Example();
  expected.key = KeyIdOf(PublicKeyOf(SeedOf(0)));
  EXPECT_EQ(shown->ticket, expected);
  EXPECT_TRUE(IsSignedBy(*shown, PublicKeyOf(SeedOf(0))));
  EXPECT_FALSE(IsSignedBy(*shown, PublicKeyOf(SeedOf(1))));
}

// Whoever changes one bit of it has no ticket any more.
TEST(TicketTest, AChangedTicketIsRefused) {
  const std::string text = *SignTicket(Example(), SeedOf(0));
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  for (std::size_t at = 0; at < text.size(); ++at) {
    std::string changed = text;
    changed[at] = kDigits[(kDigits.find(text[at]) ^ 16) % kDigits.size()];
    const auto shown = ParseTicket(changed);
    EXPECT_FALSE(shown.ok() && IsSignedBy(*shown, PublicKeyOf(SeedOf(0)))) << "character " << at;
  }
}

// A ticket whose signature was cut off, or of which any part is missing or too much.
TEST(TicketTest, AStrippedTicketIsRefused) {
  const std::string text = *SignTicket(Example(), SeedOf(0));
  for (std::size_t size = 0; size < text.size(); ++size) {
    const auto shown = ParseTicket(std::string_view(text).substr(0, size));
    EXPECT_FALSE(shown.ok() && IsSignedBy(*shown, PublicKeyOf(SeedOf(0)))) << size << " characters";
  }
  EXPECT_FALSE(ParseTicket(text + "AAAA").ok());
  EXPECT_FALSE(ParseTicket(text + "=").ok()) << "one ticket has one text";
  EXPECT_FALSE(ParseTicket(text + "\n").ok());
  EXPECT_THAT(std::string(ParseTicket("").status().message()), HasSubstr("ticket: "));
  EXPECT_THAT(std::string(ParseTicket(std::string(kMaxTicketText + 1, 'A')).status().message()), HasSubstr("1737"));
}

TEST(TicketTest, EveryLimitIsCheckedAndNamed) {
  const auto with = [](auto change) {
    Ticket ticket = Example();
    change(ticket);
    return WhyNot(ticket);
  };
  EXPECT_THAT(with([](Ticket& t) { t.lifetime = 0s; }), HasSubstr("ticket: lifetime: 0 s"));
  EXPECT_THAT(with([](Ticket& t) { t.lifetime = 301s; }), HasSubstr("ticket: lifetime: 301 s is not in 1 to 300 s"));
  EXPECT_THAT(with([](Ticket& t) { t.issued_at = -1ms; }), HasSubstr("ticket: issued_at: "));
  EXPECT_THAT(with([](Ticket& t) { t.number = 0; }), HasSubstr("ticket: number: "));
  EXPECT_THAT(with([](Ticket& t) { t.instance = std::string(64, 'x'); }), HasSubstr("ticket: instance: "));
  EXPECT_THAT(with([](Ticket& t) { t.player_id.clear(); }), HasSubstr("ticket: player_id: 0 bytes are not 1 to 64"));
  EXPECT_THAT(with([](Ticket& t) { t.player_id = std::string(65, 'x'); }), HasSubstr("ticket: player_id: "));
  EXPECT_THAT(with([](Ticket& t) { t.player_id = "a\nb"; }), HasSubstr("ticket: player_id: has a control character"));
  EXPECT_THAT(with([](Ticket& t) { t.name = "\xff"; }), HasSubstr("ticket: name: is not UTF-8"));
  EXPECT_THAT(with([](Ticket& t) { t.name = std::string(33, 'x'); }), HasSubstr("ticket: name: "));
  EXPECT_THAT(with([](Ticket& t) { t.properties.resize(9, {"x", true}); }), HasSubstr("9 are more than 8"));
  EXPECT_THAT(with([](Ticket& t) { t.properties = {{"a", true}, {"a", false}}; }), HasSubstr("\"a\" is there twice"));
  EXPECT_THAT(with([](Ticket& t) { t.properties = {{"", true}}; }), HasSubstr("ticket: properties: "));
  EXPECT_THAT(with([](Ticket& t) {
                t.properties = {{"a", std::numeric_limits<double>::infinity()}};
              }),
              HasSubstr("not finite"));
  EXPECT_THAT(with([](Ticket& t) { t.properties = {{"a", BodyId(1)}}; }), HasSubstr("only flags"));
  EXPECT_THAT(with([](Ticket& t) { t.properties = {{"a", std::string(64, 'x')}}; }), HasSubstr("64 bytes"));
}

TEST(TicketTest, TheLongestTicketHasTheLongestText) {
  Ticket ticket = Example();
  ticket.instance = std::string(kMaxTicketInstance, 'i');
  ticket.player_id = std::string(kMaxTicketPlayerId, 'p');
  ticket.name = std::string(32, 'n');
  ticket.properties.clear();
  for (char c = 'a'; c < 'a' + static_cast<char>(kMaxTicketProperties); ++c) {
    ticket.properties.emplace_back(std::string(63, c), std::string(63, 'v'));
  }
  const auto text = SignTicket(ticket, SeedOf(0));
  ASSERT_TRUE(text.ok()) << text.status();
  EXPECT_EQ(text->size(), kMaxTicketText);
  EXPECT_TRUE(ParseTicket(*text).ok());
}

TEST(TicketTest, ItsTimeIsJudgedWithALeeway) {
  const Ticket ticket = Example();
  const auto at = [&](std::chrono::seconds from_issue) { return CheckTime(ticket, ticket.issued_at + from_issue); };
  EXPECT_TRUE(at(0s).ok());
  EXPECT_TRUE(at(-30s).ok());
  EXPECT_TRUE(at(330s).ok());
  EXPECT_THAT(std::string(at(-31s).message()), HasSubstr("ticket: was issued 31 s in the future"));
  EXPECT_THAT(std::string(at(331s).message()), HasSubstr("ticket: ran out 31 s ago"));
  EXPECT_EQ(at(24h).code(), absl::StatusCode::kUnauthenticated) << "yesterday's";
}

}  // namespace
}  // namespace tessera::trust
