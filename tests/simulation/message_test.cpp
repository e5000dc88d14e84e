// Messages between bodies of all regions, and area effects, under every fault: each message is applied exactly once,
// and in order; each area effect acts exactly once on each body (talking_instance.h).
//
// TESSERA_MESSAGE_SEEDS=N runs N seeds instead of a few, from TESSERA_MESSAGE_FIRST on or the first: 260 of them have
// 1300 deaths.
#include <gmock/gmock.h>

#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

#include "tests/simulation/disturbance.h"
#include "tests/simulation/talking_instance.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

void ExpectBlasts(const BlastCount& count) {
  EXPECT_GT(count.sent, 0U);
  EXPECT_EQ(count.lost, 0U);
  EXPECT_EQ(count.doubled, 0U);
  EXPECT_EQ(count.mistaken, 0U);
}

TEST(MessageSimulationTest, WithoutFaultsEachMessageIsInTimeAndNothingIsLeft) {
  Talk talk(600, 0.3);
  TalkingInstance world(talk, 4, 1);
  world.RunAllTo(Tick(1'400));
  EXPECT_THAT(world.simulation().problems(), IsEmpty());
  const Count count = world.Compare();
  EXPECT_GT(count.sent, 4'000U);
  EXPECT_EQ(count.lost, 0U);
  EXPECT_EQ(count.doubled, 0U);
  ExpectBlasts(world.CompareBlasts());
  EXPECT_EQ(talk.wrong().order, 0U);
  EXPECT_EQ(world.backend.wrong(), 0U);
  EXPECT_EQ(world.Errors(), 0U);
  EXPECT_EQ(world.Late(), 0U) << "of " << world.Applied();
  EXPECT_EQ(world.LeftOver(), 0U) << "nothing grows for ever";
  EXPECT_EQ(world.InstanceOwners(), 1U);
  std::printf("%lu messages, %lu handovers, %lu late\n", static_cast<unsigned long>(count.sent),
              static_cast<unsigned long>(world.simulation().totals().handovers),
              static_cast<unsigned long>(world.Late()));
}

TEST(MessageSimulationTest, OnAnyNetworkTheSameBits) {
  const auto play = [](std::uint64_t seed, Micros jitter) {
    Talk talk(300, 0.3);
    PacketConditions conditions;
    conditions.jitter = jitter;
    TalkingInstance world(talk, 4, seed, conditions);
    world.RunAllTo(Tick(360));
    std::vector<std::int64_t> counts{world.PropertyOf(kInstanceBody, "total")};
    for (std::uint64_t a = kFirstBall; a < kFirstBall + kBalls; ++a) {
      for (std::uint64_t b = kFirstBall; b < kFirstBall + kBalls; ++b) {
        counts.push_back(world.PropertyOf(BodyId(a), GotFrom(b)));
      }
    }
    return std::pair(world.simulation().hash(), counts);
  };
  EXPECT_EQ(play(1, 0), play(9, Milliseconds(8)));
}

int NumberIn(const char* variable, int otherwise) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? otherwise : std::atoi(text);
}

// Packets that are lost, late, doubled and overtaken, more of them with some seeds than with others.
PacketConditions AnyConditions(Chance& chance) {
  PacketConditions conditions;
  conditions.loss = 0.01 * static_cast<double>(chance.Below(3));
  conditions.jitter = Milliseconds(static_cast<Micros>(chance.Below(8)));
  conditions.reorder = 0.01 * static_cast<double>(chance.Below(3));
  conditions.duplicate = 0.01 * static_cast<double>(chance.Below(3));
  return conditions;
}

// Figures of all seeds.
struct FaultTotals {
  std::uint64_t seeds = 0, deaths = 0, handovers = 0, planned = 0, closings = 0;
  std::uint64_t sent = 0, to_moving = 0, applied = 0, between = 0, late = 0;
  std::uint64_t pushes = 0;
  std::uint64_t lost = 0, doubled = 0, out_of_order = 0;

  void Print() const {
    const auto of = [](std::uint64_t value) { return static_cast<unsigned long>(value); };
    std::printf(
        "%lu seeds, %lu deaths, %lu handovers, %lu planned maps, %lu borders closed: %lu messages, %lu to bodies in "
        "handover, %lu of %lu applied came from another region, %lu late; %lu pushes by area effects; %lu lost, %lu "
        "doubled, %lu out of order\n",
        of(seeds), of(deaths), of(handovers), of(planned), of(closings), of(sent), of(to_moving), of(between),
        of(applied), of(late), of(pushes), of(lost), of(doubled), of(out_of_order));
    std::fflush(stdout);
  }
};

void RunUnderFaults(std::uint64_t seed, FaultTotals& totals) {
  constexpr std::uint64_t kLast = 1'500;
  constexpr double kToMoving = 0.9;  // then a tenth of all messages go to bodies in handover
  Chance chance(seed);
  Talk talk(kLast, 0.3, kToMoving);
  TalkingInstance world(talk, 4, seed, AnyConditions(chance));
  Disturb(*world.instance, chance, Tick(kLast));
  world.simulation().RunFor(Milliseconds(1'000));
  world.simulation().Settle();
  world.RunAllTo(world.simulation().tick() + 1'200);
  EXPECT_THAT(world.simulation().problems(), IsEmpty());
  const Count count = world.Compare();
  const BlastCount blasts = world.CompareBlasts();
  EXPECT_EQ(count.lost, 0U);
  EXPECT_EQ(count.doubled, 0U);
  ExpectBlasts(blasts);
  EXPECT_EQ(talk.wrong().order, 0U);
  EXPECT_EQ(world.backend.wrong(), 0U);
  EXPECT_EQ(world.Errors(), 0U);
  EXPECT_EQ(world.InstanceOwners(), 1U);
  ++totals.seeds;
  totals.deaths += world.instance->control->totals().deaths;
  totals.handovers += world.simulation().totals().handovers;
  totals.planned += world.instance->control->totals().planned;
  totals.closings += world.simulation().Closings();
  totals.sent += count.sent;
  totals.to_moving += count.to_moving;
  totals.applied += world.Applied();
  totals.between += world.Between();
  totals.late += world.Late();
  totals.pushes += blasts.sent;
  totals.lost += count.lost + blasts.lost;
  totals.doubled += count.doubled + blasts.doubled;
  totals.out_of_order += talk.wrong().order + world.backend.wrong();
}

TEST(MessageSimulationTest, UnderEveryFaultNoMessageOrAreaEffectIsLostDoubledOrOutOfOrder) {
  FaultTotals totals;
  const int first = NumberIn("TESSERA_MESSAGE_FIRST", 1), count = NumberIn("TESSERA_MESSAGE_SEEDS", 3);
  for (int seed = first; seed < first + count; ++seed) {
    SCOPED_TRACE(seed);
    RunUnderFaults(static_cast<std::uint64_t>(seed), totals);
    totals.Print();
  }
  EXPECT_GE(2 * totals.between, totals.applied) << "half of the messages go to another region";
  EXPECT_GE(10 * totals.to_moving, totals.sent) << "a tenth of them go to bodies that are being handed over";
  EXPECT_GT(totals.deaths, 0U);
  EXPECT_GT(totals.planned, 0U);
  EXPECT_GT(totals.closings, 0U);
}

}  // namespace
}  // namespace tessera::simulation
