// FakeGameWorld: a few bodies without a region, for tests of the game host.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/game/game_world.h"
#include "core/world/prefab.h"

namespace tessera::game {

class FakeGameWorld : public GameWorld {
 public:
  FakeGameWorld() : scene_(std::make_shared<Scene>()) {
    scene_->kinds = {"", "crate", "ball"};
    scene_->bounds = {{-100, -100, -100}, {100, 100, 100}};
    AddPrefab("ball", 1);
    AddPrefab("train", 3);
    scene_->instance_properties = {{"goals", std::int64_t{0}}};
    scene_->properties = {{"health", std::int64_t{100}},
                          {"name", std::string("none")},
                          {"heat", 0.5},
                          {"on", false},
                          {"home", Vec3d{1, 2, 3}},
                          {"target", BodyId()},
                          {"note", PropertyBytes{}}};
  }

  // A body of the kind, of 2 kg, that this region owns unless told otherwise.
  void Add(std::uint64_t id, std::uint16_t kind, bool owned = true) {
    Body& body = bodies_[BodyId(id)];
    body.def.id = BodyId(id);
    body.def.kind = kind;
    body.def.mass_kg = 2;
    body.owned = owned;
  }
  void Lose(std::uint64_t id) { bodies_.at(BodyId(id)).owned = false; }
  // Properties are then "health" and "team".
  void SetTeams() {
    scene_->properties.push_back({"team", std::string()});
    scene_->team_property = "team";
  }
  void SetLayers(std::vector<std::string> names) { scene_->layers = std::move(names); }
  std::shared_ptr<const Scene> shared_scene() const { return scene_; }
  BodyState& state(std::uint64_t id) { return bodies_.at(BodyId(id)).state; }
  const GameRecord& record(std::uint64_t id) const { return bodies_.at(BodyId(id)).record; }
  PropertyValue property(std::uint64_t id, std::string_view name) const {
    const Body& body = bodies_.at(BodyId(id));
    return *ValueOf(scene_->properties, body.def.properties, body.changed, name);
  }
  int commits() const { return commits_; }

  BodyDef& def(std::uint64_t id) { return bodies_.at(BodyId(id)).def; }
  BodyId anchored;  // joints hold it to the world
  mutable std::vector<BodyQuery> asked;
  QueryResult answer;  // to every query

  const Scene& scene() const override { return *scene_; }
  RegionId region() const override { return region_; }
  void set_region(std::uint32_t region) { region_ = RegionId(region); }
  const BodyDef* Find(BodyId id) const override {
    const auto found = bodies_.find(id);
    return found == bodies_.end() ? nullptr : &found->second.def;
  }
  std::size_t OwnedCount() const override {
    return static_cast<std::size_t>(
        std::ranges::count_if(bodies_, [](const auto& entry) { return entry.second.owned; }));
  }
  BodyState StateOf(BodyId id) const override { return bodies_.at(id).state; }
  Vec3f AngularImpulseFor(BodyId, Vec3d spin_rad_s) const override { return Vec3f(spin_rad_s) * 2.0f; }
  Vec3d CenterOfMassOf(const BodyDef&) const override { return {}; }
  bool IsAnchored(BodyId id) const override { return id == anchored; }
  bool Owns(BodyId id) const override {
    const auto found = bodies_.find(id);
    return found != bodies_.end() && found->second.owned;
  }
  // Notes the question, and returns `answer` but for what is not accepted.
  QueryResult FindBodies(const BodyQuery& query, const BodyPredicate& accept) const override {
    asked.push_back(query);
    QueryResult accepted = answer;
    if (accept != nullptr) std::erase_if(accepted.hits, [&](const QueryHit& hit) { return !accept(hit.body); });
    return accepted;
  }
  void ForEachOwned(absl::FunctionRef<void(BodyId, const BodyDef&)> visit) const override {
    for (const auto& [id, body] : bodies_) {
      if (body.owned) visit(id, body.def);
    }
  }
  std::vector<BodyId> DueBy(Tick tick) const override {
    std::vector<BodyId> due;
    for (const auto& [id, body] : bodies_) {
      if (body.owned && body.record.next_due() && *body.record.next_due() <= tick) due.push_back(id);
    }
    return due;
  }
  std::uint32_t hops = 1;
  std::optional<Answer> region_answer;  // to every question
  std::uint32_t HopsFor(const BodyQuery&) const override { return hops; }
  std::optional<Answer> AnswerTo(BodyId, const GameQuestion&) const override { return region_answer; }
  std::optional<PlayerInput> input;  // the same for every player
  const PlayerInput* InputOf(PlayerNumber) const override { return input ? &*input : nullptr; }
  Vec3d LookOf(const PlayerInput&) const override { return {0, 0, -1}; }
  std::vector<BodyId> PlayerBodies() const override {
    std::vector<BodyId> players;
    for (const auto& [id, body] : bodies_) {
      if (body.owned && IsPlayerBody(id)) players.push_back(id);
    }
    return players;
  }
  std::vector<BodyId> Commanded() const override {
    std::vector<BodyId> commanded = PlayerBodies();
    std::erase_if(commanded, [this](BodyId id) { return bodies_.at(id).record.player->commands.empty(); });
    return commanded;
  }
  // The body of a player of this name.
  GameRecord& AddPlayer(std::uint32_t number, std::string name = "") {
    const BodyId id = PlayerBodyId(PlayerNumber(number));
    Add(id.value(), 0);
    bodies_.at(id).changed.set_player_name(std::move(name));
    return bodies_.at(id).record;
  }
  // Bodies that the transaction made are not here yet.
  PropertySet ChangedOf(BodyId id) const override {
    return bodies_.contains(id) ? bodies_.at(id).changed : PropertySet();
  }
  const GameRecord& RecordOf(BodyId id) const override {
    static const GameRecord kNone;
    return bodies_.contains(id) ? bodies_.at(id).record : kNone;
  }
  PropertySet KnownOfInstance() const override { return known_; }
  void set_known_of_instance(PropertySet known) { known_ = std::move(known); }
  std::optional<BodyId> NextId(std::size_t prefab) override { return ids_.Next(prefab); }
  std::optional<JointId> NextJoint() override { return ids_.NextJoint(); }
  std::vector<BodyId> Jointed() const override {
    std::vector<BodyId> jointed;
    for (const auto& [id, body] : bodies_) {
      if (body.owned && !body.record.joints.empty()) jointed.push_back(id);
    }
    return jointed;
  }
  std::vector<BodyId> Steering() const override {
    std::vector<BodyId> steering;
    for (const auto& [id, body] : bodies_) {
      const bool steers = body.record.driver != PlayerNumber() || body.record.player->controls != BodyId();
      if (body.owned && steers) steering.push_back(id);
    }
    return steering;
  }
  std::vector<Blast> blasts;
  std::size_t BlastCount() const override { return blasts.size(); }
  void Explode(Blast blast) override { blasts.push_back(std::move(blast)); }
  std::vector<BodyId> assembly;  // those of it are one, beside what is asked for
  std::vector<BodyId> AssemblyOf(BodyId id) const override {
    if (std::ranges::find(assembly, id) != assembly.end()) return assembly;
    return {id};
  }
  bool AreConnected(BodyId a, BodyId b) const override {
    const GameRecord& record = bodies_.at(std::min(a, b)).record;
    return std::ranges::any_of(record.joints, [&](const GameJoint& joint) { return joint.other == std::max(a, b); });
  }
  bool IsRemoved(BodyId id) const override { return !bodies_.contains(id); }
  void Commit(BodyId id, const PropertySet& changed, GameRecord record, bool together) override {
    ++commits_;
    bodies_.at(id).changed = changed;
    bodies_.at(id).record = std::move(record);
    bodies_.at(id).together = together;
  }
  // Whether the body's last change came with those of others.
  bool together(std::uint64_t id) const { return bodies_.at(BodyId(id)).together; }
  void Spawn(BodyId id, const BodyState& state) override {
    bodies_[id] = {MakeSpawned(*scene_, id), state, {}, {}, true};
  }
  void Place(BodyId id, const BodyState& state) override { bodies_.at(id).state = state; }
  void Remove(BodyId id) override { bodies_.erase(id); }
  std::vector<BodyId> ids() const {
    std::vector<BodyId> ids;
    for (const auto& [id, body] : bodies_) ids.push_back(id);
    return ids;
  }

 private:
  void AddPrefab(std::string name, std::size_t bodies) {
    Prefab& prefab = scene_->prefabs.emplace_back();
    prefab.name = std::move(name);
    for (std::size_t i = 0; i < bodies; ++i) {
      BodyDef& def = prefab.bodies.emplace_back();
      def.id = BodyId(i + 1);
      def.kind = 2;
      def.mass_kg = 2;
      def.initial.position = {static_cast<double>(i), 0, 0};
    }
  }

  struct Body {
    BodyDef def;
    BodyState state;
    PropertySet changed;
    GameRecord record;
    bool owned = true, together = false;
  };

  const std::shared_ptr<Scene> scene_;
  std::map<BodyId, Body> bodies_;
  SpawnedIds ids_{Incarnation(1)};
  RegionId region_{1};
  PropertySet known_;
  int commits_ = 0;
};

}  // namespace tessera::game
