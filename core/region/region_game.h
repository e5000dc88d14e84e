// RegionGame: the game of a region: turns what a step reported into events of the game, and lets the game see and
// change what the region owns.
//
// Bodies that the game makes are owned from the end of the tick on, and those that it removes are gone by then.
//
// A pair's begin or end is an event for both of its bodies; the one that another region owns gets it by a message, and
// static bodies are told where the pair is reported. Thread rule: one thread at a time.
//
// It has some 50 methods because it is the game's whole world: two thirds are those of game::GameWorld, and most of
// them pass the question to the part that owns the data.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "core/game/game_host.h"
#include "core/game/game_world.h"
#include "core/physics/world.h"
#include "core/region/bodies.h"
#include "core/region/catalog.h"
#include "core/region/message_relay.h"
#include "core/region/ownership.h"
#include "core/region/pair_reports.h"
#include "core/region/question_desk.h"
#include "core/region/record_table.h"
#include "core/region/region_players.h"
#include "core/region/shared_properties.h"
#include "core/region/tombstones.h"
#include "core/world/spawned_id.h"
#include "game_sdk/api/api.h"

namespace tessera::region {

class RegionGame : private game::GameWorld {
 public:
  // Without a host there is no game, and it does nothing. All others must outlive it.
  RegionGame(std::shared_ptr<game::GameHost> host, RegionId self, Incarnation maker, const Catalog& catalog,
             const Bodies& bodies, RecordTable& records, Ownership& ownership, Tombstones& tombstones,
             OutputCommit& output, SharedProperties& shared, BlastTable& blasts, const MessageRelay& messages,
             const RegionPlayers& players, const PairReports& reports, const QuestionDesk& questions)
      : host_(std::move(host)),
        self_(self),
        catalog_(catalog),
        bodies_(bodies),
        records_(records),
        ownership_(ownership),
        tombstones_(tombstones),
        output_(output),
        shared_(shared),
        blasts_(blasts),
        messages_(messages),
        players_(players),
        reports_(reports),
        questions_(questions),
        ids_(maker) {}

  // After the step to `tick`, with the events that this region reports, and the players who came and go. Returns the
  // bodies that it removed.
  std::vector<Departure> Run(Tick tick, std::span<const physics::PairEvent> events,
                             const game::PlayerChanges& players = {});
  // Whether players that leave are removed by Run: a game is told before, and messages of theirs still leave.
  bool TakesLeave() const { return host_ != nullptr; }
  // Whether what is left of this removed body was a body after this tick, as far as this region knows.
  bool LivedAfter(BodyId id, Tick tick) const {
    const auto retired = retired_.find(id);
    return retired != retired_.end() && retired->second > tick;
  }
  game::GameHost* host() const { return host_.get(); }
  // The game's own movement of players' bodies; null without one.
  const GameMovement* movement() const { return host_ == nullptr ? nullptr : host_->movement(); }
  // The game's movement has moved this player's body, or failed to.
  void NoteMoved(Tick tick, PlayerNumber player, const std::string& error) { host_->NoteMoved(tick, player, error); }
  // Number of the game that runs; 0 without one.
  std::uint32_t number() const { return host_ == nullptr ? 0 : host_->number(); }
  // A game that may take the place of the one that runs, by a map with its number; only the last one counts.
  void Prepare(std::shared_ptr<game::GameHost> next) { next_ = std::move(next); }
  bool Has(std::uint32_t number) const { return number == this->number() || IsNext(number); }
  // From the next tick on the game with this number runs. Requires Has(number).
  void Adopt(std::uint32_t number);
  // The region made a body without the game.
  void NoteMade(BodyId id);
  // The state of the host in an earlier life of this region that is in no record.
  void AdoptHost(const game::HostState& state);
  // The same of another region, or of several: the events that go with what `comes` here with that state. Of two bodies
  // of which one does not move and the other one is gone, they are this region's if `takes` says so of both.
  void AdoptEvents(const game::HostState& state, absl::FunctionRef<bool(BodyId)> comes,
                   absl::FunctionRef<bool(const BodyDef& still, BodyId gone)> takes);
  // These bodies are about to be handed over: their events that wait are put into their records.
  void PackEvents(std::span<const BodyId> bodies);
  // GameHost::Inspect in this region, right after `tick`. Requires a game.
  void Inspect(Tick tick, game::GameHost::Inspection act) { host_->Inspect(tick, *this, act); }

 private:
  void EndTouches(BodyId id);
  // Events that bodies brought along wait for their turn here.
  void UnpackEvents();
  bool IsNext(std::uint32_t number) const { return next_ != nullptr && next_->number() == number; }
  const Scene& scene() const override { return catalog_.scene(); }
  RegionId region() const override { return self_; }
  const BodyDef* Find(BodyId id) const override;
  BodyState StateOf(BodyId id) const override { return bodies_.world().StateOf(id); }
  Vec3f AngularImpulseFor(BodyId id, Vec3d spin_rad_s) const override {
    return bodies_.world().AngularImpulseFor(id, spin_rad_s);
  }
  Vec3d CenterOfMassOf(const BodyDef& def) const override;
  bool IsAnchored(BodyId id) const override;
  // The remains of a removed body are nothing that a game sees.
  bool Owns(BodyId id) const override {
    return bodies_.IndexOf(id) >= 0 || (id == kInstanceBody && bodies_.FindBodiless(id) != nullptr);
  }
  std::size_t OwnedCount() const override { return bodies_.owned().size(); }
  QueryResult FindBodies(const BodyQuery& query, const BodyPredicate& accept) const override {
    return bodies_.world().FindBodies(query, accept);
  }
  void ForEachOwned(absl::FunctionRef<void(BodyId, const BodyDef&)> visit) const override;
  std::vector<BodyId> DueBy(Tick tick) const override { return records_.DueBy(tick); }
  std::uint32_t HopsFor(const BodyQuery& query) const override { return questions_.HopsFor(query); }
  std::optional<game::Answer> AnswerTo(BodyId asker, const game::GameQuestion& question) const override {
    return questions_.AnswerTo(asker, question, tick_);
  }
  const PlayerInput* InputOf(PlayerNumber player) const override;
  Vec3d LookOf(const PlayerInput& input) const override;
  std::vector<BodyId> PlayerBodies() const override;
  std::vector<BodyId> Commanded() const override { return {records_.commanded().begin(), records_.commanded().end()}; }
  PropertySet ChangedOf(BodyId id) const override;
  const game::GameRecord& RecordOf(BodyId id) const override;
  PropertySet KnownOfInstance() const override;
  std::optional<BodyId> NextId(std::size_t prefab) override { return ids_.Next(prefab); }
  std::optional<JointId> NextJoint() override { return ids_.NextJoint(); }
  std::vector<BodyId> Jointed() const override;
  std::vector<BodyId> Steering() const override;
  std::size_t BlastCount() const override { return blasts_.all().size(); }
  void Explode(game::Blast blast) override { blasts_.Make(std::move(blast), tick_); }
  std::vector<BodyId> AssemblyOf(BodyId id) const override;
  bool AreConnected(BodyId a, BodyId b) const override;
  bool IsRemoved(BodyId id) const override;
  void Commit(BodyId id, const PropertySet& changed, game::GameRecord record, bool together) override;
  void Spawn(BodyId id, const BodyState& state) override;
  void Place(BodyId id, const BodyState& state) override { ownership_.Place(id, state); }
  void Remove(BodyId id) override;

  std::shared_ptr<game::GameHost> host_, next_;
  const RegionId self_;
  const Catalog& catalog_;
  const Bodies& bodies_;
  RecordTable& records_;
  Ownership& ownership_;
  Tombstones& tombstones_;
  OutputCommit& output_;
  SharedProperties& shared_;
  BlastTable& blasts_;
  const MessageRelay& messages_;
  const RegionPlayers& players_;
  const PairReports& reports_;
  const QuestionDesk& questions_;
  SpawnedIds ids_;
  Tick tick_;
  std::vector<Departure> removed_;  // in this tick
  std::map<BodyId, Tick> retired_;  // bodies that were removed with messages under way, while they are
};

}  // namespace tessera::region
