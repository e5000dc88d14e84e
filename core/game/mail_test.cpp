#include "core/game/mail.h"

#include <gmock/gmock.h>

#include <map>
#include <random>

#include "core/game/settings.h"

namespace tessera::game {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr BodyId kSender{7}, kOther{8}, kTarget{20};

Message Named(std::string name) { return {kSender, 0, std::move(name), {}}; }

HeldMessage Copy(const SentMessage& sent, std::uint64_t due = 0) {
  HeldMessage held;
  held.sender = kSender;
  held.number = sent.number;
  held.after = sent.after;
  held.made = sent.made;
  held.due = due == 0 ? sent.made + DeliveryTicks(1) : Tick(due);
  held.what = sent.what;
  return held;
}

std::vector<std::uint64_t> NumbersOf(const std::vector<HeldMessage>& messages) {
  std::vector<std::uint64_t> numbers;
  numbers.reserve(messages.size());
  for (const HeldMessage& message : messages) numbers.push_back(message.number);
  return numbers;
}

TEST(MailTest, TakesTwoTicksMoreForEachBorder) {
  EXPECT_EQ(DeliveryTicks(1), 4U);
  EXPECT_EQ(DeliveryTicks(2), 6U);
  EXPECT_EQ(DeliveryTicks(3), 8U);
}

TEST(MailTest, AMessageThatOvertakesWaitsForTheOneBefore) {
  Mail sender, target;
  const SentMessage first = sender.Post(kTarget, Tick(10), RegionId(1), Named("a"));
  const SentMessage second = sender.Post(kTarget, Tick(10), RegionId(1), Named("b"));
  EXPECT_EQ(first.after, 0U);
  EXPECT_EQ(second.after, first.number);
  EXPECT_EQ(target.Take(Copy(second), Tick(13)), Mail::Arrival::kNew);
  EXPECT_THAT(target.Due(Tick(100)), IsEmpty());
  EXPECT_EQ(target.next_due(), std::nullopt);
  EXPECT_EQ(target.Take(Copy(first), Tick(90)), Mail::Arrival::kNew);
  EXPECT_THAT(NumbersOf(target.Due(Tick(100))), ElementsAre(1, 2));
  EXPECT_EQ(target.next_due(), Tick(14));
}

TEST(MailTest, ACopyIsKnownBeforeAndAfterItIsApplied) {
  Mail sender, target;
  const SentMessage message = sender.Post(kTarget, Tick(10), RegionId(1), Named("a"));
  EXPECT_EQ(target.Take(Copy(message), Tick(12)), Mail::Arrival::kNew);
  EXPECT_EQ(target.Take(Copy(message), Tick(13)), Mail::Arrival::kRepeated);
  EXPECT_TRUE(target.Applied(kSender, message.number, Tick(14)));
  EXPECT_FALSE(target.Applied(kSender, message.number, Tick(14)));
  EXPECT_EQ(target.Take(Copy(message), Tick(15)), Mail::Arrival::kRepeated);
}

TEST(MailTest, WhatIsSentWithinARegionComesAfterWhatIsUnderWay) {
  Mail sender, target;
  const SentMessage first = sender.Post(kTarget, Tick(10), RegionId(1), Named("a"));
  HeldMessage direct{kSender, ++sender.last_number, sender.LastTo(kTarget), Tick(11), Tick(13), 0, Named("b")};
  EXPECT_TRUE(target.TakeDirectly(direct));
  EXPECT_THAT(target.Due(Tick(13)), IsEmpty()) << "the first one has not come";
  target.Take(Copy(first, 20), Tick(14));
  EXPECT_THAT(target.Due(Tick(19)), IsEmpty());
  const std::vector<HeldMessage> due = target.Due(Tick(20));
  EXPECT_THAT(NumbersOf(due), ElementsAre(1, 2));
  EXPECT_EQ(due[1].due, Tick(20));
}

TEST(MailTest, MessagesOfSeveralSendersAreAppliedByWhenTheyAreDue) {
  Mail target;
  target.TakeDirectly({kOther, 1, 0, Tick(1), Tick(5), 0, Named("late")});
  target.TakeDirectly({kSender, 4, 0, Tick(1), Tick(5), 0, Named("b")});
  target.TakeDirectly({kOther, 2, 0, Tick(1), Tick(3), 0, Named("waits")});
  target.TakeDirectly({kSender, 3, 0, Tick(1), Tick(3), 0, Named("a")});
  std::vector<std::string> names;
  for (const HeldMessage& message : target.Due(Tick(9))) names.push_back(message.what.name);
  EXPECT_THAT(names, ElementsAre("a", "b", "late", "waits"));
}

TEST(MailTest, ATargetForgetsASenderOnlyWhenThatHasConfirmed) {
  Mail sender, target;
  const SentMessage message = sender.Post(kTarget, Tick(10), RegionId(1), Named("a"));
  target.Take(Copy(message), Tick(12));
  EXPECT_FALSE(sender.Settled(kTarget, message.number));
  EXPECT_FALSE(target.Confirmed(kSender, message.number, Tick(13))) << "it is not applied";
  target.Applied(kSender, message.number, Tick(14));
  EXPECT_FALSE(target.ForgetsBy(Tick(10'000)));
  EXPECT_TRUE(sender.Acknowledged(kTarget, message.number));
  EXPECT_FALSE(sender.Acknowledged(kTarget, message.number));
  EXPECT_TRUE(sender.Settled(kTarget, message.number));
  const Mail::Sender remembered = target.senders.at(0);
  std::vector<std::uint64_t> reminders;
  for (std::uint64_t tick = 14; tick < 6'000; ++tick) {
    if (Mail::RemindIn(remembered, Tick(tick))) reminders.push_back(tick - 14);
  }
  EXPECT_THAT(reminders, ElementsAre(60, 120, 240, 480, 960, 1920, 3840, 5760));
  EXPECT_TRUE(target.Confirmed(kSender, message.number, Tick(80)));
  EXPECT_FALSE(target.Forget(Tick(80 + 2 * kTransitTicks - 1))) << "a copy may be under way";
  EXPECT_TRUE(target.Forget(Tick(80 + 2 * kTransitTicks)));
  EXPECT_TRUE(target.empty());
}

TEST(MailTest, AnOldConfirmationDoesNotEndWhatHasGoneOn) {
  Mail sender, target;
  const SentMessage first = sender.Post(kTarget, Tick(10), RegionId(1), Named("a"));
  target.Take(Copy(first), Tick(12));
  target.Applied(kSender, 1, Tick(14));
  sender.Acknowledged(kTarget, 1);
  const SentMessage second = sender.Post(kTarget, Tick(70), RegionId(1), Named("b"));
  EXPECT_EQ(second.after, 0U) << "the first one is there for good";
  target.Take(Copy(second), Tick(72));
  EXPECT_FALSE(target.Confirmed(kSender, 1, Tick(73)));
  target.Applied(kSender, 2, Tick(74));
  EXPECT_FALSE(target.Confirmed(kSender, 1, Tick(75)));
}

TEST(MailTest, WhatATargetHoldsIsBounded) {
  Mail target;
  for (std::uint64_t n = 1; n <= kMaxInbox; ++n) {
    EXPECT_EQ(target.Take({kSender, n, 0, Tick(1), Tick(5), 1, Named("a")}, Tick(2)), Mail::Arrival::kNew);
  }
  EXPECT_EQ(target.Take({kSender, kMaxInbox + 1, 0, Tick(1), Tick(5), 1, Named("a")}, Tick(2)),
            Mail::Arrival::kRefused);
  EXPECT_FALSE(target.TakeDirectly({kOther, 1, 0, Tick(1), Tick(5), 0, Named("a")}));
  Mail popular;
  for (std::uint64_t n = 1; n <= kMaxSenders + 10; ++n) {
    popular.Take({BodyId(n), 1, 0, Tick(n), Tick(n), 1, Named("a")}, Tick(n));
    popular.Applied(BodyId(n), 1, Tick(n));
  }
  EXPECT_EQ(popular.senders.size(), kMaxSenders);
  EXPECT_EQ(popular.senders.front().id, BodyId(11)) << "those that were silent longest are forgotten";
}

// A network that loses, doubles and reorders everything, between senders and a target.
TEST(MailTest, WhateverTheNetworkDoesEachMessageIsAppliedOnceAndInOrder) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    std::mt19937_64 random(seed);
    const auto chance = [&](unsigned percent) { return random() % 100 < percent; };
    std::map<BodyId, Mail> senders;
    Mail target;
    std::map<BodyId, std::vector<std::string>> applied;
    struct Packet {
      Tick at, sent;
      int kind = 0;  // 0: a message, 1: an acknowledgement, 2: a confirmation
      BodyId sender;
      HeldMessage message;
    };
    std::vector<Packet> network;
    const auto send = [&](Tick now, Packet packet) {
      packet.sent = now;
      for (int copies = chance(30) ? 0 : chance(30) ? 2 : 1; copies > 0; --copies) {
        packet.at = now + 1 + random() % (kTransitTicks - 1);
        network.push_back(packet);
      }
    };
    constexpr std::uint64_t kLast = 3'000;
    for (std::uint64_t t = 1; t < kLast + 30'000; ++t) {
      const Tick now(t);
      for (const BodyId id : {kSender, kOther}) {
        Mail& mail = senders[id];
        if (t < kLast && chance(20) && mail.outbox.size() < kMaxOutbox) {
          mail.Post(kTarget, now, RegionId(1), Named(std::to_string(mail.last_number)));
        }
        for (const SentMessage& message : mail.outbox) {
          if ((t - message.made.value()) % 30 != 0) continue;
          HeldMessage copy = Copy(message);
          copy.sender = id;
          send(now, {{}, {}, 0, id, copy});
        }
      }
      std::vector<Packet> coming;
      std::erase_if(network, [&](const Packet& packet) {
        if (packet.at == now) coming.push_back(packet);
        return packet.at == now;
      });
      for (const Packet& packet : coming) {
        Mail& sender = senders[packet.sender];
        if (packet.kind == 0) {
          if (target.Take(packet.message, now) != Mail::Arrival::kRefused) {
            send(now, {{}, {}, 1, packet.sender, packet.message});
          }
        } else if (packet.kind == 1) {
          if (!sender.Acknowledged(kTarget, packet.message.number) && sender.Settled(kTarget, packet.message.number)) {
            send(now, {{}, {}, 2, packet.sender, packet.message});
          }
        } else {
          target.Confirmed(packet.sender, packet.message.number, now);
        }
      }
      for (const HeldMessage& message : target.Due(now)) {
        applied[message.sender].push_back(message.what.name);
        target.Applied(message.sender, message.number, now);
      }
      for (const Mail::Sender& sender : target.senders) {
        if (!Mail::RemindIn(sender, now)) continue;
        HeldMessage newest;
        newest.number = sender.applied;
        send(now, {{}, {}, 1, sender.id, newest});
      }
      target.Forget(now);
      ASSERT_TRUE(CheckMail(target).ok()) << CheckMail(target);
    }
    for (const auto& [id, mail] : senders) {
      EXPECT_THAT(mail.outbox, IsEmpty());
      ASSERT_EQ(applied[id].size(), mail.last_number) << "seed " << seed;
      for (std::uint64_t n = 0; n < mail.last_number; ++n) ASSERT_EQ(applied[id][n], std::to_string(n));
    }
    EXPECT_THAT(target.inbox, IsEmpty());
    EXPECT_THAT(target.senders, IsEmpty()) << "nothing grows for ever";
  }
}

Mail FullMail() {
  Mail mail;
  mail.last_number = 9;
  mail.outbox = {{3, 0, kTarget, Tick(5), RegionId(2), Named("a")}, {9, 3, kTarget, Tick(6), RegionId(2), Named("b")}};
  mail.inbox = {{kSender, 4, 2, Tick(1), Tick(5), 3, Named("c")}};
  mail.senders = {{kSender, 2, Tick(4), Tick(0)}, {kOther, 5, Tick(4), Tick(99)}};
  return mail;
}

TEST(MailTest, ComesBackAsItWas) {
  ByteWriter out;
  Write(out, FullMail());
  const std::vector<std::uint8_t> bytes = out.Take();
  ByteReader in(bytes);
  EXPECT_EQ(ReadMail(in), FullMail());
  EXPECT_TRUE(in.ok()) << in.error();
  EXPECT_EQ(in.remaining(), 0U);
  EXPECT_TRUE(CheckMail(FullMail()).ok()) << CheckMail(FullMail());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ByteReader cut({bytes.data(), size});
    (void)ReadMail(cut);
    EXPECT_FALSE(cut.ok()) << size;
  }
}

TEST(MailTest, WhatNoRegionSendsIsRefused) {
  const auto refused = [](const auto& change) {
    Mail mail = FullMail();
    change(mail);
    return std::string(CheckMail(mail).message());
  };
  EXPECT_THAT(refused([](Mail& mail) { mail.outbox[1].number = 3; }), HasSubstr("outbox: numbers do not ascend"));
  EXPECT_THAT(refused([](Mail& mail) { mail.outbox[1].after = 9; }), HasSubstr("outbox: numbers do not ascend"));
  EXPECT_THAT(refused([](Mail& mail) { mail.last_number = 8; }), HasSubstr("a number above the last one"));
  EXPECT_THAT(refused([](Mail& mail) { mail.inbox.push_back(mail.inbox[0]); }), HasSubstr("inbox: out of order"));
  EXPECT_THAT(refused([](Mail& mail) { mail.inbox[0].after = 4; }), HasSubstr("waits for itself"));
  EXPECT_THAT(refused([](Mail& mail) { mail.inbox[0].what.values = {1}; }), HasSubstr("inbox: values"));
  EXPECT_THAT(refused([](Mail& mail) { std::swap(mail.senders[0], mail.senders[1]); }), HasSubstr("out of order"));
}

}  // namespace
}  // namespace tessera::game
