// TalkingInstance: balls of all regions that send messages to each other and the world, publish events and ask for area
// effects, and count all of that. For tests: it expects.
//
// The bodies count for themselves: a sender in a property for each target, a target in one for each sender. A message
// carries the sender's count; the target compares it with its own. Every area effect reaches the whole field and has a
// number; who asks for it and whom it pushes add the numbers up. What a death sets back it sets back in both. A model
// of the control plane takes the events for the backend.
//
//   Talk talk(600, 0.3);
//   TalkingInstance world(talk, 4, seed);
//   world.simulation().RunTo(Tick(1'400));
//   EXPECT_EQ(world.Compare().lost, 0U);
//
// Thread rule: one thread at a time.
#pragma once

#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/game/testing/named_fields.h"
#include "core/game/testing/scripted_game.h"
#include "core/region/testing/kept_bodies.h"
#include "game_sdk/api/api.h"
#include "tests/simulation/instance.h"

namespace tessera::simulation {

inline constexpr double kFieldHalf_m = 20;
inline constexpr std::uint64_t kBalls = 16, kFirstBall = 5;  // behind the four walls
inline constexpr int kMostExtra = 3;
inline constexpr std::uint64_t kFirstTick = 10;  // standbys have whole copies by then
// A ball that talks asks for an area effect as well: a hundred are kept at once, of at most 256.
inline constexpr double kBlastShare = 0.035;
inline constexpr float kHaste = 4;  // times as fast as the swarm flies elsewhere, for many handovers
// A ball that finds another one of its own region asks once more, so that most messages go to another region.
inline constexpr double kAskAgain = 0.5;
inline constexpr double kWholeField_m = 100, kBlast_ns = 0.05;
// An area effect's number is the ball's id times this, and how many the ball has asked for.
inline constexpr std::int64_t kBlastsOfBall = 1'000'000;

inline std::string SentTo(std::uint64_t target) { return "s" + std::to_string(target); }
inline std::string GotFrom(std::uint64_t sender) { return "r" + std::to_string(sender); }

inline std::shared_ptr<const Scene> TalkingSwarm() {
  Scene scene = *Swarm(kFieldHalf_m, kBalls).Build();
  scene.kinds = {"", "ball"};
  for (BodyDef& body : scene.bodies) {
    body.kind = body.motion == Motion::kDynamic ? 1 : 0;
    body.initial.linear_velocity = body.initial.linear_velocity * kHaste;
  }
  for (std::uint64_t i = 0; i < kBalls; ++i) {
    scene.properties.push_back({SentTo(kFirstBall + i), std::int64_t{0}});
    scene.properties.push_back({GotFrom(kFirstBall + i), std::int64_t{0}});
  }
  for (const char* const name : {"reported", "published", "to_moving", "blasts", "pushed", "push_sum"}) {
    scene.properties.push_back({name, std::int64_t{0}});
  }
  scene.instance_properties = {{"total", std::int64_t{0}}};
  return std::make_shared<const Scene>(std::move(scene));
}

struct Wrong {
  std::uint64_t order = 0, errors = 0;
};

// Sends, counts and compares, until `last`. `to_moving`: share of messages that go to a body that is being handed over,
// while there is one.
class Talk {
 public:
  using Arguments = game::ScriptedGame::Arguments;

  Talk(std::uint64_t last, double share, double to_moving = 0) : last_(last), share_(share), to_moving_(to_moving) {
    game_.On(game::kOnBodyTick, "ball",
             [this](GameCalls& calls, Arguments arguments) { return Act(calls, arguments[0].as.id); });
    game_.On(game::kOnBodyMessage, "ball",
             [this](GameCalls& calls, Arguments arguments) { return Take(calls, arguments); });
    game_.On(game::kOnBodyBlast, "ball", [](GameCalls& calls, Arguments arguments) {
      return Add(calls, arguments[0].as.id, "pushed", 1) &&
             Add(calls, arguments[0].as.id, "push_sum", NumberIn(arguments[1]));
    });
    game_.On(game::kOnWorldMessage, "", [](GameCalls& calls, Arguments) {
      if (!calls.Call(game::kWorldGet, {std::string("total")})) return false;
      return calls.Call(game::kWorldSet, {std::string("total"), calls.result().as.whole + 1});
    });
    module_ = game_.module();
  }
  const tessera_game_module& module() const { return module_; }
  const Wrong& wrong() const { return wrong_; }
  // Balls that are being handed over.
  void SetMoving(std::vector<std::uint64_t> moving) { moving_ = std::move(moving); }

 private:
  using GameCalls = game::GameCalls;
  using GameValue = game::GameValue;

  static std::int64_t Get(GameCalls& calls, std::uint64_t body, const std::string& name) {
    EXPECT_TRUE(calls.Call(game::kBodyGet, {BodyId(body), name})) << calls.error();
    return calls.result().as.whole;
  }
  static bool Set(GameCalls& calls, std::uint64_t body, const std::string& name, std::int64_t value) {
    return calls.Call(game::kBodySet, {BodyId(body), name, value});
  }
  static bool Add(GameCalls& calls, std::uint64_t body, const std::string& name, std::int64_t more) {
    return Set(calls, body, name, Get(calls, body, name) + more);
  }
  // The number of the area effect that on_blast is called with.
  static std::int64_t NumberIn(const tessera_game_value& blast) {
    for (const tessera_game_field& field : std::span(blast.as.fields, blast.count)) {
      if (std::string_view(field.name, field.name_bytes) != "name") continue;
      return std::stoll(std::string(field.value.as.text, field.value.count));
    }
    return 0;
  }
  static double Chance(GameCalls& calls) {
    calls.Call(game::kWorldRandom, {});
    return calls.result().as.real;
  }

  bool Act(GameCalls& calls, std::uint64_t self) {
    calls.Call(game::kWorldTick, {});
    const auto tick = static_cast<std::uint64_t>(calls.result().as.whole);
    if (tick < kFirstTick || tick > last_ || Chance(calls) > share_) return true;
    if (Chance(calls) < kBlastShare && !Explode(calls, self)) return false;
    const auto extra = static_cast<int>(Chance(calls) * kMostExtra);
    for (int i = 0; i <= extra; ++i) {
      const std::uint64_t target = Target(calls);
      const std::int64_t count = Get(calls, self, SentTo(target)) + 1;
      tessera_game_field fields[2] = {{"from", 4, {}}, {"n", 1, {}}};
      fields[0].value.type = fields[1].value.type = TESSERA_GAME_WHOLE;
      fields[0].value.as.whole = static_cast<std::int64_t>(self);
      fields[1].value.as.whole = count;
      const GameValue name = std::string("n");
      tessera_game_value values[3] = {game::ToInterface(GameValue(BodyId(target))), game::ToInterface(name), {}};
      values[2].type = TESSERA_GAME_FIELDS;
      values[2].count = 2;
      values[2].as.fields = fields;
      if (!calls.CallRaw(game::kBodySend, values)) continue;  // a full outbox is no fault
      if (!Set(calls, self, SentTo(target), count)) return false;
      if (std::ranges::binary_search(moving_, target) && !Add(calls, self, "to_moving", 1)) return false;
    }
    if (extra != 0) return true;
    if (!calls.Call(game::kWorldSend, {std::string("one more")})) return true;
    return Set(calls, self, "reported", Get(calls, self, "reported") + 1) && Publish(calls, self);
  }
  std::uint64_t Target(GameCalls& calls) const {
    if (!moving_.empty() && to_moving_ > 0 && Chance(calls) < to_moving_) {
      return moving_[static_cast<std::size_t>(Chance(calls) * static_cast<double>(moving_.size()))];
    }
    const std::uint64_t target = kFirstBall + static_cast<std::uint64_t>(Chance(calls) * kBalls);
    calls.Call(game::kBodyIsOwn, {BodyId(target)});
    const bool again = calls.result().as.whole != 0 && Chance(calls) < kAskAgain;
    return again ? kFirstBall + static_cast<std::uint64_t>(Chance(calls) * kBalls) : target;
  }
  // One that is refused, because the region keeps too many, is no fault.
  static bool Explode(GameCalls& calls, std::uint64_t self) {
    const std::int64_t count = Get(calls, self, "blasts") + 1;
    const GameValue falloff = std::string("none");
    const GameValue name = std::to_string(static_cast<std::int64_t>(self) * kBlastsOfBall + count);
    if (!calls.Call(game::kBodyPosition, {BodyId(self)})) return false;
    const game::NamedFields blast{{"at", calls.result()},
                                  {"falloff", game::ToInterface(falloff)},
                                  {"impulse", game::ToInterface(GameValue(kBlast_ns))},
                                  {"name", game::ToInterface(name)},
                                  {"radius", game::ToInterface(GameValue(kWholeField_m))}};
    const tessera_game_value options = blast.value();
    return !calls.CallRaw(game::kWorldExplode, {&options, 1}) || Set(calls, self, "blasts", count);
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
    const auto from = static_cast<std::uint64_t>(arguments[2].as.fields[0].value.as.whole);
    const std::int64_t count = arguments[2].as.fields[1].value.as.whole;
    if (count != Get(calls, self, GotFrom(from)) + 1) ++wrong_.order;
    return Set(calls, self, GotFrom(from), count);
  }

  const std::uint64_t last_;
  const double share_, to_moving_;
  std::vector<std::uint64_t> moving_;  // ascending
  game::ScriptedGame game_;
  tessera_game_module module_{};
  Wrong wrong_;
};

struct Count {
  std::uint64_t sent = 0, lost = 0, doubled = 0;
  std::uint64_t to_moving = 0;  // their targets were being handed over
  void Add(std::int64_t made, std::int64_t came) {
    sent += static_cast<std::uint64_t>(made);
    lost += static_cast<std::uint64_t>(std::max<std::int64_t>(0, made - came));
    doubled += static_cast<std::uint64_t>(std::max<std::int64_t>(0, came - made));
  }
};
// Area effects, each once for each body that it is to push.
struct BlastCount : Count {
  std::uint64_t mistaken = 0;  // bodies that were pushed as often as they should, and not by each once
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
  TalkingInstance(Talk& talk, std::uint32_t regions, std::uint64_t seed, const PacketConditions& conditions = {})
      : scene_(TalkingSwarm()) {
    SimulationOptions options;
    options.seed = seed;
    options.conditions = conditions;
    options.game = [this, &talk](std::shared_ptr<const Scene> scene) -> std::shared_ptr<game::GameHost> {
      auto host = game::GameHost::Load(talk.module(), {"talk", ""}, std::move(scene), {}, 7);
      EXPECT_TRUE(host.ok()) << host.status();
      return hosts_.emplace_back(*std::move(host));
    };
    SceneBuilder builder(kFieldHalf_m);
    builder.scene() = *scene_;
    instance = std::make_unique<Instance>(builder, regions, options);
    simulation().on_step = [this, &talk, before = simulation().on_step](SimulatedRegion& worker,
                                                                        const region::StepResult& result) {
      if (before) before(worker, result);
      backend.Look(worker.region());
      NoteMoving(worker, result, talk);
    };
  }

  Simulation& simulation() { return *instance->simulation; }
  // Until all regions stand at this tick: none has handed a body out that another one has yet to take in.
  void RunAllTo(Tick tick) {
    for (const auto& [id, worker] : simulation().workers()) worker->set_target(tick);
    simulation().RunTo(tick);
  }
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
    std::int64_t reported = 0;
    for (std::uint64_t from = kFirstBall; from < kFirstBall + kBalls; ++from) {
      reported += PropertyOf(BodyId(from), "reported");
      count.to_moving += static_cast<std::uint64_t>(PropertyOf(BodyId(from), "to_moving"));
      for (std::uint64_t to = kFirstBall; to < kFirstBall + kBalls; ++to) {
        count.Add(PropertyOf(BodyId(from), SentTo(to)), PropertyOf(BodyId(to), GotFrom(from)));
      }
    }
    count.Add(reported, PropertyOf(kInstanceBody, "total"));
    for (std::uint64_t from = kFirstBall; from < kFirstBall + kBalls; ++from) {
      count.Add(PropertyOf(BodyId(from), "published"), backend.Got(BodyId(from)));
    }
    return count;
  }
  BlastCount CompareBlasts() {
    std::int64_t made = 0, sum = 0;
    for (std::uint64_t id = kFirstBall; id < kFirstBall + kBalls; ++id) {
      const std::int64_t blasts = PropertyOf(BodyId(id), "blasts");
      made += blasts;
      sum += static_cast<std::int64_t>(id) * kBlastsOfBall * blasts + blasts * (blasts + 1) / 2;
    }
    BlastCount count;
    for (std::uint64_t id = kFirstBall; id < kFirstBall + kBalls; ++id) {
      const std::int64_t pushed = PropertyOf(BodyId(id), "pushed");
      count.Add(made, pushed);
      count.mistaken += pushed == made && PropertyOf(BodyId(id), "push_sum") != sum ? 1 : 0;
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
  // Applied in another region than the one in which they were made.
  std::uint64_t Between() const {
    std::uint64_t within = 0;
    for (const auto& host : hosts_) within += host->statistics().messages.by_hops[0];
    return Applied() - within;
  }
  std::uint64_t Late() const { return Sum(&game::MessageStatistics::late); }
  std::uint64_t Applied() const { return Sum(&game::MessageStatistics::applied); }
  std::uint64_t Errors() const {
    std::uint64_t errors = 0;
    for (const auto& host : hosts_) errors += host->statistics().errors;
    return errors;
  }

  std::unique_ptr<Instance> instance;
  Backend backend;

 private:
  using Bytes = region::Bytes;
  // A body is being handed over as long as a living region that granted it keeps its copy.
  void NoteMoving(const SimulatedRegion& worker, const region::StepResult& result, Talk& talk) {
    std::vector<BodyId>& kept = kept_[worker.id()];
    if (result.handed_out == 0 && kept.empty()) return;
    kept = region::KeptBodies(worker.region());
    std::erase_if(kept_, [this](const auto& entry) { return !simulation().Alive(entry.first); });
    std::set<std::uint64_t> moving;
    for (const auto& [region, bodies] : kept_) {
      for (const BodyId body : bodies) {
        if (body != kInstanceBody) moving.insert(body.value());
      }
    }
    talk.SetMoving({moving.begin(), moving.end()});
  }
  std::uint64_t Sum(std::uint64_t game::MessageStatistics::*field) const {
    std::uint64_t sum = 0;
    for (const auto& host : hosts_) sum += host->statistics().messages.*field;
    return sum;
  }

  std::shared_ptr<const Scene> scene_;
  std::vector<std::shared_ptr<game::GameHost>> hosts_;
  std::map<RegionId, std::vector<BodyId>> kept_;  // that a region has granted, and keeps
};

}  // namespace tessera::simulation
