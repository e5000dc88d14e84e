// BodyForces: the forces that act on bodies in the next step beside contacts and joints: gravity, the scene's fields,
// and what a player's input or a game does.
//
// A field's force depends on a body's state alone, and it is evaluated once for each state: where a body is
// predicted, after the step, and again where the force is applied, before the next one. Thread rule: one thread at a
// time.
#pragma once

#include <span>
#include <vector>

#include "core/physics/prediction.h"
#include "core/region/bodies.h"
#include "core/region/body_notes.h"
#include "core/region/record_table.h"
#include "core/region/region_players.h"

namespace tessera::region {

class BodyForces {
 public:
  // `scene` must outlive it.
  BodyForces(const Scene& scene, double tick_s) : scene_(scene), tick_s_(tick_s) {}

  // Forgets what fields did: all states are others.
  void StatesChanged();
  // Forces on each owned body, by index; none on a sleeper. Valid until the next call that is not const.
  std::span<const physics::Forces> Find(const Bodies& bodies, const RegionPlayers& players, const RecordTable& records);
  // The forces that the last Find found.
  std::span<const physics::Forces> found() const { return forces_; }
  // Pushes all bodies for the next step; gravity is the world's own. Ghosts are pushed by what their owners reported.
  void Apply(const RegionPlayers& players, const RecordTable& records, Bodies& bodies);

  void Validate() const { fields_.Validate(); }

 private:
  struct FieldNote {
    Vec3d acceleration_m_s2;
    bool known = false;
  };
  Vec3d FieldOn(std::size_t index, const BodyState& state);
  // Pushes owned bodies by the scene's fields and by players' inputs.
  void ApplyFields(const RegionPlayers& players, Bodies& bodies);
  void ApplyToGhosts(Bodies& bodies) const;

  const Scene& scene_;
  const double tick_s_;
  BodyNotes<FieldNote> fields_;          // written by FieldOn, until StatesChanged
  std::vector<physics::Forces> forces_;  // scratch of Find
};

}  // namespace tessera::region
