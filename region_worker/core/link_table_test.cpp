#include "region_worker/core/link_table.h"

#include <gmock/gmock.h>

#include "net/protocol.h"
#include "region_worker/testing/small_world.h"

namespace tessera::worker {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr RegionId kLower{1}, kMiddle{2}, kHigher{3}, kHighest{4};
constexpr TimePoint kNow = TimePoint(std::chrono::hours(1));

PeerAddress AddressOf(RegionId region, std::uint64_t incarnation) {
  return {region, Incarnation(incarnation), "host", 7000, 8000};
}

class LinkTableTest : public testing::Test {
 protected:
  void SetAddress(RegionId region, std::uint64_t incarnation) {
    const std::vector<PeerAddress> peers = {AddressOf(region, incarnation)};
    links_.SetAddresses(peers, actions_);
  }
  void SetPartners(std::vector<RegionId> partners) { links_.SetPartners(partners, actions_); }
  void LinkUp(RegionId region, std::uint64_t incarnation) {
    links_.Up(region, Incarnation(incarnation), kNow, actions_);
  }
  void SendFrame(RegionId to, std::uint8_t content) { links_.SendFrames({{to, {content}}}, actions_); }
  // The content of the frames that went to a region.
  std::vector<int> TakeFrames(RegionId to) {
    std::vector<int> frames;
    for (const SentMessage& sent : TakeSent(actions_)) {
      if (sent.to == to) frames.push_back(sent.bytes->front());
    }
    return frames;
  }
  std::vector<RegionId> TakeCuts() {
    std::vector<RegionId> cuts;
    for (const CutLink& cut : AllOf<CutLink>(actions_)) cuts.push_back(cut.region);
    actions_.clear();
    return cuts;
  }

  LinkTable links_{kMiddle};
  Actions actions_;
};

TEST_F(LinkTableTest, TheLowerOfTwoPartnersDialsOnceItKnowsWhere) {
  SetPartners({kLower, kHigher});
  EXPECT_FALSE(links_.Dials(kHigher));
  SetAddress(kLower, 1);
  SetAddress(kHigher, 1);
  SetAddress(kHighest, 1);
  EXPECT_TRUE(links_.Dials(kHigher));
  EXPECT_FALSE(links_.Dials(kLower));
  EXPECT_FALSE(links_.Dials(kHighest)) << "no partner";
  LinkUp(kHigher, 1);
  EXPECT_FALSE(links_.Dials(kHigher));
  links_.Down(kHigher);
  EXPECT_TRUE(links_.Dials(kHigher));
}

TEST_F(LinkTableTest, AllAreLinkedWhenEachPartnerIs) {
  SetPartners({kLower, kHigher});
  LinkUp(kLower, 1);
  EXPECT_FALSE(links_.AllLinked());
  LinkUp(kHigher, 1);
  EXPECT_TRUE(links_.AllLinked());
  EXPECT_THAT(links_.Linked(), ElementsAre(kLower, kHigher));
}

TEST_F(LinkTableTest, LetsInPartnersAndThoseWithAnAddressOfNoLifeThatHasEnded) {
  EXPECT_THAT(std::string(links_.Admit(kHigher, Incarnation(1)).message()), HasSubstr("region 3 is not expected"));
  SetPartners({kLower});
  EXPECT_TRUE(links_.Admit(kLower, Incarnation(1)).ok());
  SetAddress(kHigher, 3);
  EXPECT_TRUE(links_.Admit(kHigher, Incarnation(3)).ok());
  EXPECT_TRUE(links_.Admit(kHigher, Incarnation(4)).ok()) << "an order says so later";
  EXPECT_THAT(std::string(links_.Admit(kHigher, Incarnation(2)).message()), HasSubstr("fenced by 3"));
  links_.Fence(kHigher, Incarnation(3), actions_);
  EXPECT_THAT(std::string(links_.Admit(kHigher, Incarnation(3)).message()), HasSubstr("declared dead"));
  EXPECT_TRUE(links_.Admit(kHigher, Incarnation(4)).ok());
}

TEST_F(LinkTableTest, AnEndedLifeIsCutAndDialledNoMoreButTheNextOneIs) {
  SetPartners({kHigher});
  SetAddress(kHigher, 1);
  LinkUp(kHigher, 1);
  links_.Fence(kHigher, Incarnation(1), actions_);
  EXPECT_THAT(TakeCuts(), ElementsAre(kHigher));
  EXPECT_FALSE(links_.Dials(kHigher));
  SetAddress(kHigher, 2);
  EXPECT_TRUE(links_.Dials(kHigher));
  LinkUp(kHigher, 2);
  links_.Fence(kHigher, Incarnation(1), actions_);
  EXPECT_THAT(TakeCuts(), IsEmpty()) << "it is the next life that is linked";
}

TEST_F(LinkTableTest, AnotherWorkerOfARegionTakesThePlaceOfItsLink) {
  SetAddress(kHigher, 1);
  LinkUp(kHigher, 1);
  SetAddress(kHigher, 1);
  EXPECT_THAT(TakeCuts(), IsEmpty());
  SetAddress(kHigher, 2);
  EXPECT_THAT(TakeCuts(), ElementsAre(kHigher));
}

TEST_F(LinkTableTest, OnlyTheDiallerEndsALinkThatIsNotNeeded) {
  SetPartners({kLower, kHigher});
  LinkUp(kLower, 1);
  LinkUp(kHigher, 1);
  SetPartners({});
  EXPECT_THAT(TakeCuts(), ElementsAre(kHigher));
}

TEST_F(LinkTableTest, ANewLinkBeginsWithTheLastTwoFrames) {
  for (std::uint8_t content = 1; content <= 3; ++content) SendFrame(kHigher, content);
  EXPECT_THAT(TakeFrames(kHigher), IsEmpty());
  LinkUp(kHigher, 1);
  EXPECT_THAT(TakeFrames(kHigher), ElementsAre(2, 3));
  SendFrame(kHigher, 4);
  EXPECT_THAT(TakeFrames(kHigher), ElementsAre(4));
  links_.RepeatFrames(actions_);
  EXPECT_THAT(TakeFrames(kHigher), ElementsAre(4));
  links_.Down(kHigher);
  LinkUp(kHigher, 1);
  EXPECT_THAT(TakeFrames(kHigher), ElementsAre(3, 4));
}

// An order may say at once that a region has died and where its next life is.
TEST_F(LinkTableTest, TheNextLifeOfARegionGetsNoFramesOfTheLast) {
  SetAddress(kHigher, 1);
  LinkUp(kHigher, 1);
  SendFrame(kHigher, 1);
  SetAddress(kHigher, 2);
  links_.Fence(kHigher, Incarnation(1), actions_);
  actions_.clear();
  LinkUp(kHigher, 2);
  EXPECT_THAT(TakeFrames(kHigher), IsEmpty());
}

TEST_F(LinkTableTest, MessagesGoNowhereWithoutALink) {
  links_.Send(kHigher, {1}, actions_);
  EXPECT_THAT(actions_, IsEmpty());
  LinkUp(kHigher, 1);
  actions_.clear();
  links_.Send(kHigher, {1}, actions_);
  EXPECT_THAT(TakeFrames(kHigher), ElementsAre(1));
}

TEST_F(LinkTableTest, EachLinkHasItsOwnNumberAndALinkThatIsDownHasNone) {
  EXPECT_EQ(links_.LinkTo(kHigher), 0U);
  LinkUp(kHigher, 1);
  const LinkTable::LinkNumber first = links_.LinkTo(kHigher);
  EXPECT_NE(first, 0U);
  links_.Down(kHigher);
  EXPECT_EQ(links_.LinkTo(kHigher), 0U);
  LinkUp(kHigher, 1);
  EXPECT_NE(links_.LinkTo(kHigher), first);
}

TEST_F(LinkTableTest, RemembersWhenARegionWasLastHeard) {
  EXPECT_EQ(links_.HeardFrom(kHigher), std::nullopt);
  LinkUp(kHigher, 1);
  EXPECT_EQ(links_.HeardFrom(kHigher), kNow);
  links_.Heard(kHigher, kNow + std::chrono::seconds(1));
  links_.Down(kHigher);
  EXPECT_EQ(links_.HeardFrom(kHigher), kNow + std::chrono::seconds(1));
}

TEST_F(LinkTableTest, AFrameThatCannotBeSentIsAnError) {
  links_.SendFrames({{kHigher, region::Bytes(net::kMaxFrameBytes)}}, actions_);
  EXPECT_TRUE(links_.health().ok());
  links_.SendFrames({{kHigher, region::Bytes(net::kMaxFrameBytes + 1)}}, actions_);
  EXPECT_EQ(links_.health().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(links_.health().message()), HasSubstr("for region 3"));
}

}  // namespace
}  // namespace tessera::worker
