// Messages between bodies of all regions under every fault: each is applied exactly once, and in order. Area effects
// over the whole world push every body exactly once.
//
// The same holds for events for the backend, which a model of the control plane takes.
//
// The bodies count for themselves: a sender in a property for each target, a target in one for each sender, each body
// the area effects that it made and those that pushed it. A message carries the sender's count; the target compares it
// with its own. What a death sets back it sets back in both.
//
// TESSERA_MESSAGE_SEEDS=N runs N seeds instead of a few: 62 of them send a million messages.
#include <gmock/gmock.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "core/game/testing/scripted_game.h"
#include "core/region/message_relay.h"
#include "game_sdk/api/api.h"
#include "tests/simulation/disturbance.h"
#include "tests/simulation/instance.h"

namespace tessera::simulation {
namespace {

using game::GameCalls;
using game::GameHost;
using game::GameValue;
using game::ScriptedGame;
using ::testing::IsEmpty;
using Arguments = ScriptedGame::Arguments;

constexpr double kFieldHalf_m = 20;
constexpr std::uint64_t kBalls = 16, kFirstBall = 5;  // behind the four walls
constexpr int kMostExtra = 3;
constexpr double kShareOfBlasts = 0.005;  // of a ball's ticks: some 50 of the whole world live at once
constexpr std::uint64_t kFirstTick = 10;  // standbys have whole copies by then

std::string SentTo(std::uint64_t target) { return "s" + std::to_string(target); }
std::string GotFrom(std::uint64_t sender) { return "r" + std::to_string(sender); }

std::shared_ptr<const Scene> TalkingSwarm() {
  Scene scene = *Swarm(kFieldHalf_m, kBalls).Build();
  scene.kinds = {"", "ball"};
  for (BodyDef& body : scene.bodies) body.kind = body.motion == Motion::kDynamic ? 1 : 0;
  for (std::uint64_t i = 0; i < kBalls; ++i) {
    scene.properties.push_back({SentTo(kFirstBall + i), std::int64_t{0}});
    scene.properties.push_back({GotFrom(kFirstBall + i), std::int64_t{0}});
  }
  scene.properties.push_back({"reported", std::int64_t{0}});
  scene.properties.push_back({"published", std::int64_t{0}});
  scene.properties.push_back({"exploded", std::int64_t{0}});
  scene.properties.push_back({"blown", std::int64_t{0}});
  scene.instance_properties = {{"total", std::int64_t{0}}};
  return std::make_shared<const Scene>(std::move(scene));
}

struct Wrong {
  std::uint64_t order = 0, errors = 0;
};

// Messages that were applied: those that came from another region, and those to a body that changed hands meanwhile or
// just before.
struct Shares {
  std::uint64_t applied = 0, between_regions = 0, in_handover = 0;
};

// When bodies changed hands, as the test sees it from outside.
class Handovers {
 public:
  static constexpr Tick::rep kLately = 6;

  void Look(const region::Region& region, Tick tick) {
    newest_ = std::max(newest_, tick);
    for (const region::OwnedBody& body : region.owned()) {
      const auto [at, first] = owners_.try_emplace(body.def->id.value(), region.id(), Tick());
      if (!first && at->second.first != region.id()) at->second = {region.id(), tick};
    }
  }
  bool Since(std::uint64_t body, Tick tick) const {
    const auto at = owners_.find(body);
    return at != owners_.end() && at->second.second != Tick() && at->second.second + kLately > tick;
  }
  // One that changed hands lately; 0 if none did.
  std::uint64_t Lately() const {
    const auto at = std::ranges::find_if(owners_, [&](const auto& entry) { return Since(entry.first, newest_); });
    return at == owners_.end() ? 0 : at->first;
  }

 private:
  std::map<std::uint64_t, std::pair<RegionId, Tick>> owners_;  // of each body, and since when if not from the beginning
  Tick newest_;
};

// Sends, counts and compares, until `last`.
class Talk {
 public:
  Talk(std::uint64_t last, double share) : last_(last), share_(share) {
    game_.On(game::kOnBodyTick, "ball",
             [this](GameCalls& calls, Arguments arguments) { return Act(calls, arguments[0].as.id); });
    game_.On(game::kOnBodyMessage, "ball",
             [this](GameCalls& calls, Arguments arguments) { return Take(calls, arguments); });
    game_.On(game::kOnBodyBlast, "ball", [](GameCalls& calls, Arguments arguments) {
      const std::uint64_t self = arguments[0].as.id;
      return Set(calls, self, "blown", Get(calls, self, "blown") + 1);
    });
    game_.On(game::kOnWorldMessage, "", [](GameCalls& calls, Arguments) {
      if (!calls.Call(game::kWorldGet, {std::string("total")})) return false;
      return calls.Call(game::kWorldSet, {std::string("total"), calls.result().as.whole + 1});
    });
    module_ = game_.module();
  }
  const tessera_game_module& module() const { return module_; }
  const Wrong& wrong() const { return wrong_; }
  const Shares& shares() const { return shares_; }
  // Where it is given, some messages go to bodies that change hands, and that is counted.
  const Handovers* handovers = nullptr;

 private:
  static std::int64_t Get(GameCalls& calls, std::uint64_t body, const std::string& name) {
    EXPECT_TRUE(calls.Call(game::kBodyGet, {BodyId(body), name})) << calls.error();
    return calls.result().as.whole;
  }
  static bool Set(GameCalls& calls, std::uint64_t body, const std::string& name, std::int64_t value) {
    return calls.Call(game::kBodySet, {BodyId(body), name, value});
  }
  static bool IsOwn(GameCalls& calls, std::uint64_t body) {
    EXPECT_TRUE(calls.Call(game::kBodyIsOwn, {BodyId(body)})) << calls.error();
    return calls.result().as.whole != 0;
  }
  static double Chance(GameCalls& calls) {
    calls.Call(game::kWorldRandom, {});
    return calls.result().as.real;
  }

  bool Act(GameCalls& calls, std::uint64_t self) {
    calls.Call(game::kWorldTick, {});
    const auto tick = static_cast<std::uint64_t>(calls.result().as.whole);
    if (tick < kFirstTick || tick > last_) return true;
    if (Chance(calls) < kShareOfBlasts && !Explode(calls, self)) return false;
    if (Chance(calls) > share_) return true;
    const auto extra = static_cast<int>(Chance(calls) * kMostExtra);
    for (int i = 0; i <= extra; ++i) {
      std::uint64_t target = kFirstBall + static_cast<std::uint64_t>(Chance(calls) * kBalls);
      bool here = IsOwn(calls, target);
      if (here) target = kFirstBall + static_cast<std::uint64_t>(Chance(calls) * kBalls);
      if (handovers != nullptr && i % 2 == 0 && handovers->Lately() != 0) target = handovers->Lately();
      here = IsOwn(calls, target);
      const std::int64_t count = Get(calls, self, SentTo(target)) + 1;
      tessera_game_field fields[4] = {{"from", 4, {}}, {"here", 4, {}}, {"n", 1, {}}, {"tick", 4, {}}};
      const std::int64_t numbers[4] = {static_cast<std::int64_t>(self), here, count, static_cast<std::int64_t>(tick)};
      for (std::size_t field = 0; field < 4; ++field) {
        fields[field].value.type = TESSERA_GAME_WHOLE;
        fields[field].value.as.whole = numbers[field];
      }
      const GameValue name = std::string("n");
      tessera_game_value values[3] = {game::ToInterface(GameValue(BodyId(target))), game::ToInterface(name), {}};
      values[2].type = TESSERA_GAME_FIELDS;
      values[2].count = 4;
      values[2].as.fields = fields;
      // A full outbox is no fault.
      if (calls.CallRaw(game::kBodySend, values) && !Set(calls, self, SentTo(target), count)) return false;
    }
    if (extra != 0) return true;
    if (!calls.Call(game::kWorldSend, {std::string("one more")})) return true;
    return Set(calls, self, "reported", Get(calls, self, "reported") + 1) && Publish(calls, self);
  }
  // Over the whole world, and so weak that it changes nothing. As many as the region keeps already are no fault.
  static bool Explode(GameCalls& calls, std::uint64_t self) {
    const GameValue at{Vec3d()}, impulse{1e-6}, radius{4 * kFieldHalf_m}, falloff{std::string("none")};
    const tessera_game_field fields[] = {{"at", 2, game::ToInterface(at)},
                                         {"falloff", 7, game::ToInterface(falloff)},
                                         {"impulse", 7, game::ToInterface(impulse)},
                                         {"radius", 6, game::ToInterface(radius)}};
    tessera_game_value table{};
    table.type = TESSERA_GAME_FIELDS;
    table.count = 4;
    table.as.fields = fields;
    return !calls.CallRaw(game::kWorldExplode, {&table, 1}) ||
           Set(calls, self, "exploded", Get(calls, self, "exploded") + 1);
  }
  static bool Publish(GameCalls& calls, std::uint64_t self) {
    const std::int64_t count = Get(calls, self, "published") + 1;
    tessera_game_field field{"n", 1, {}};
    field.value.type = TESSERA_GAME_WHOLE;
    field.value.as.whole = count;
    const GameValue name = std::string("one more");
    tessera_game_value values[2] = {game::ToInterface(name), {}};
    values[1].type = TESSERA_GAME_FIELDS;
    values[1].count = 1;
    values[1].as.fields = &field;
    return !calls.CallRaw(game::kWorldPublish, values) || Set(calls, self, "published", count);
  }
  bool Take(GameCalls& calls, Arguments arguments) {
    const std::uint64_t self = arguments[0].as.id;
    const auto number = [&](std::string_view name) {
      const std::span fields(arguments[2].as.fields, arguments[2].count);
      const auto field = std::ranges::find_if(
          fields, [&](const tessera_game_field& one) { return std::string_view(one.name, one.name_bytes) == name; });
      return field->value.as.whole;
    };
    const auto from = static_cast<std::uint64_t>(number("from"));
    const std::int64_t count = number("n");
    ++shares_.applied;
    if (number("here") == 0) ++shares_.between_regions;
    const Tick made(static_cast<std::uint64_t>(number("tick")));
    if (handovers != nullptr && handovers->Since(self, made)) ++shares_.in_handover;
    if (count != Get(calls, self, GotFrom(from)) + 1) ++wrong_.order;
    return Set(calls, self, GotFrom(from), count);
  }

  const std::uint64_t last_;
  const double share_;
  ScriptedGame game_;
  tessera_game_module module_{};
  Wrong wrong_;
  Shares shares_;
};

struct Count {
  std::uint64_t sent = 0, lost = 0, doubled = 0;
};

// Takes the events for the backend as the control plane does, by their numbers, and tells the regions now and then.
class Backend {
 public:
  void Look(region::Region& region) {
    for (const game::Published::Event& event : region.published()) {
      if (event->number <= taken_) continue;
      wrong_ += event->number != taken_ + 1 || event->missed != 0 ? 1 : 0;
      taken_ = event->number;
      const auto fields = game::DecodeFields(event->values, game::kMaxMessageBytes);
      std::int64_t& last = last_[event->source];
      wrong_ += !fields.ok() || std::get<std::int64_t>(fields->front().second) != last + 1 ? 1 : 0;
      ++last;
    }
    if (++looks_ % kLooksUntilTold == 0) told_ = taken_;
    region.AcknowledgePublished(told_);
  }
  std::int64_t Got(BodyId source) const {
    const auto last = last_.find(source);
    return last == last_.end() ? 0 : last->second;
  }
  std::uint64_t wrong() const { return wrong_; }

 private:
  static constexpr std::uint64_t kLooksUntilTold = 50;
  std::uint64_t taken_ = 0, told_ = 0, looks_ = 0, wrong_ = 0;
  std::map<BodyId, std::int64_t> last_;
};

class TalkingInstance {
 public:
  TalkingInstance(Talk& talk, std::uint32_t regions, std::uint64_t seed, const PacketConditions& conditions = {},
                  bool follow_handovers = false)
      : scene_(TalkingSwarm()) {
    if (follow_handovers) talk.handovers = &handovers;
    SimulationOptions options;
    options.seed = seed;
    options.conditions = conditions;
    options.game = [this, &talk](std::shared_ptr<const Scene> scene) -> std::shared_ptr<GameHost> {
      auto host = GameHost::Load(talk.module(), {"talk", ""}, std::move(scene), {}, 7);
      EXPECT_TRUE(host.ok()) << host.status();
      return hosts_.emplace_back(*std::move(host));
    };
    SceneBuilder builder(kFieldHalf_m);
    builder.scene() = *scene_;
    instance = std::make_unique<Instance>(builder, regions, options);
    simulation().on_step = [this, before = simulation().on_step](SimulatedRegion& worker,
                                                                 const region::StepResult& result) {
      if (before) before(worker, result);
      backend.Look(worker.region());
      handovers.Look(worker.region(), result.tick);
    };
  }

  Simulation& simulation() { return *instance->simulation; }
  std::int64_t PropertyOf(BodyId body, const std::string& name) {
    const auto& declared = body == kInstanceBody ? scene_->instance_properties : scene_->properties;
    std::int64_t value = 0;
    for (const auto& [id, worker] : simulation().workers()) {
      const region::KeptRecord* record = worker->region().records().Find(body);
      if (record == nullptr || record->bytes->empty()) continue;
      const PropertySet set = PropertySet::Decode(*record->bytes, declared).value();
      value = std::get<std::int64_t>(*ValueOf(declared, {}, set, name));
    }
    return value;
  }
  Count Compare() {
    Count count;
    const auto add = [&](std::int64_t sent, std::int64_t got) {
      count.sent += static_cast<std::uint64_t>(sent);
      count.lost += static_cast<std::uint64_t>(std::max<std::int64_t>(0, sent - got));
      count.doubled += static_cast<std::uint64_t>(std::max<std::int64_t>(0, got - sent));
    };
    std::int64_t reported = 0;
    for (std::uint64_t from = kFirstBall; from < kFirstBall + kBalls; ++from) {
      reported += PropertyOf(BodyId(from), "reported");
      for (std::uint64_t to = kFirstBall; to < kFirstBall + kBalls; ++to) {
        add(PropertyOf(BodyId(from), SentTo(to)), PropertyOf(BodyId(to), GotFrom(from)));
      }
    }
    add(reported, PropertyOf(kInstanceBody, "total"));
    for (std::uint64_t from = kFirstBall; from < kFirstBall + kBalls; ++from) {
      add(PropertyOf(BodyId(from), "published"), backend.Got(BodyId(from)));
    }
    return count;
  }
  // Messages and senders that records still have.
  std::size_t LeftOver() {
    std::size_t left = 0;
    for (const auto& [id, worker] : simulation().workers()) {
      for (const region::KeptRecord& record : worker->region().records().all()) {
        const game::Mail& mail = record.game.mail;
        left += mail.outbox.size() + mail.inbox.size() + mail.senders.size();
      }
    }
    return left;
  }
  std::size_t InstanceOwners() {
    std::size_t owners = 0;
    for (const auto& [id, worker] : simulation().workers()) {
      const Bytes state = worker->region().SaveState();
      const auto decoded = region::DecodeState(state, worker->region().catalog());
      owners += decoded.ok() && decoded->Find(kInstanceBody) != nullptr ? 1 : 0;
    }
    return owners;
  }
  std::uint64_t Late() const { return Sum(&game::MessageStatistics::late); }
  std::uint64_t Applied() const { return Sum(&game::MessageStatistics::applied); }
  std::uint64_t Errors() const {
    std::uint64_t errors = 0;
    for (const auto& host : hosts_) errors += host->statistics().errors;
    return errors;
  }

  // Each has pushed every ball once.
  std::int64_t ExpectThatAreaEffectsActedOnce() {
    std::int64_t made = 0;
    for (std::uint64_t ball = kFirstBall; ball < kFirstBall + kBalls; ++ball) {
      made += PropertyOf(BodyId(ball), "exploded");
    }
    for (std::uint64_t ball = kFirstBall; ball < kFirstBall + kBalls; ++ball) {
      EXPECT_EQ(PropertyOf(BodyId(ball), "blown"), made) << "body " << ball;
    }
    return made;
  }

  std::unique_ptr<Instance> instance;
  Backend backend;
  Handovers handovers;

 private:
  using Bytes = region::Bytes;
  std::uint64_t Sum(std::uint64_t game::MessageStatistics::*field) const {
    std::uint64_t sum = 0;
    for (const auto& host : hosts_) sum += host->statistics().messages.*field;
    return sum;
  }

  std::shared_ptr<const Scene> scene_;
  std::vector<std::shared_ptr<GameHost>> hosts_;
};

TEST(MessageSimulationTest, WithoutFaultsEachMessageIsInTimeAndNothingIsLeft) {
  Talk talk(600, 0.3);
  TalkingInstance world(talk, 4, 1);
  world.simulation().RunTo(Tick(1'400));
  EXPECT_THAT(world.simulation().problems(), IsEmpty());
  const Count count = world.Compare();
  EXPECT_GT(count.sent, 4'000U);
  EXPECT_EQ(count.lost, 0U);
  EXPECT_EQ(count.doubled, 0U);
  EXPECT_EQ(talk.wrong().order, 0U);
  EXPECT_EQ(world.backend.wrong(), 0U);
  EXPECT_EQ(world.Errors(), 0U);
  EXPECT_EQ(world.Late(), 0U) << "of " << world.Applied();
  EXPECT_EQ(world.LeftOver(), 0U) << "nothing grows for ever";
  EXPECT_EQ(world.InstanceOwners(), 1U);
  EXPECT_GT(world.ExpectThatAreaEffectsActedOnce(), 20);
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
    for (const auto& [id, worker] : world.simulation().workers()) worker->set_target(Tick(360));
    world.simulation().RunTo(Tick(360));
    std::vector<std::int64_t> counts{world.PropertyOf(kInstanceBody, "total")};
    for (std::uint64_t a = kFirstBall; a < kFirstBall + kBalls; ++a) {
      counts.push_back(world.PropertyOf(BodyId(a), "blown"));
      for (std::uint64_t b = kFirstBall; b < kFirstBall + kBalls; ++b) {
        counts.push_back(world.PropertyOf(BodyId(a), GotFrom(b)));
      }
    }
    return std::pair(world.simulation().hash(), counts);
  };
  EXPECT_EQ(play(1, 0), play(9, Milliseconds(8)));
}

int SeedsToRun() {
  const char* const seeds = std::getenv("TESSERA_MESSAGE_SEEDS");
  return seeds == nullptr ? 3 : std::atoi(seeds);
}

TEST(MessageSimulationTest, UnderEveryFaultNoMessageIsLostDoubledOrOutOfOrder) {
  std::uint64_t sent = 0, kills = 0, handovers = 0, planned = 0, late = 0, applied = 0;
  std::int64_t blasts = 0;
  Shares shares;
  for (int seed = 1; seed <= SeedsToRun(); ++seed) {
    SCOPED_TRACE(seed);
    constexpr std::uint64_t kLast = 1'500;
    Talk talk(kLast, 0.3);
    TalkingInstance world(talk, 4, static_cast<std::uint64_t>(seed), {}, true);
    Chance chance(static_cast<std::uint64_t>(seed));
    Disturb(*world.instance, chance, Tick(kLast));
    world.simulation().RunFor(Milliseconds(1'000));
    world.simulation().Settle();
    world.simulation().RunTo(world.simulation().tick() + 1'200);
    EXPECT_THAT(world.simulation().problems(), IsEmpty());
    const Count count = world.Compare();
    EXPECT_EQ(count.lost, 0U);
    EXPECT_EQ(count.doubled, 0U);
    EXPECT_EQ(talk.wrong().order, 0U);
    EXPECT_EQ(world.backend.wrong(), 0U);
    EXPECT_EQ(world.Errors(), 0U);
    EXPECT_EQ(world.InstanceOwners(), 1U);
    blasts += world.ExpectThatAreaEffectsActedOnce();
    shares.applied += talk.shares().applied;
    shares.between_regions += talk.shares().between_regions;
    shares.in_handover += talk.shares().in_handover;
    sent += count.sent;
    kills += world.simulation().totals().kills;
    handovers += world.simulation().totals().handovers;
    planned += world.instance->control->totals().planned;
    late += world.Late();
    applied += world.Applied();
  }
  EXPECT_GT(blasts, 50);
  EXPECT_GE(2 * shares.between_regions, shares.applied) << "half of them go to another region";
  EXPECT_GE(10 * shares.in_handover, shares.applied) << "a tenth goes to bodies in handover";
  std::printf("%lld area effects; of %lu messages %lu went to another region, %lu to bodies in handover\n",
              static_cast<long long>(blasts), static_cast<unsigned long>(shares.applied),
              static_cast<unsigned long>(shares.between_regions), static_cast<unsigned long>(shares.in_handover));
  std::printf("%lu messages, %lu deaths, %lu handovers, %lu planned maps; %lu of %lu applied late\n",
              static_cast<unsigned long>(sent), static_cast<unsigned long>(kills),
              static_cast<unsigned long>(handovers), static_cast<unsigned long>(planned),
              static_cast<unsigned long>(late), static_cast<unsigned long>(applied));
}

}  // namespace
}  // namespace tessera::simulation
