// Relevance: which owned bodies each neighbour must have as ghosts, found anew in each tick.
//
// A body is relevant to a neighbour when
//   - its predicted swept bounds, grown by the aura, reach one of the neighbour's cells;
//   - it may soon touch a body of the neighbour's, or one that becomes the neighbour's, wherever that is;
//   - it lies up to ghost_depth contacts behind such a body, and that moves: what lies still is held by its loads;
//   - its island is relevant as a whole (whole_islands.h), or its assembly is;
//   - it sleeps, and the neighbour saw it fall asleep: taking it away would wake what leans on it.
//
// Besides, it counts for how long each relevant body has hardly moved: one that has for kSettledTicks is settled.
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/prediction.h"
#include "core/region/bodies.h"
#include "core/region/body_notes.h"
#include "core/region/catalog.h"
#include "core/region/departing_body.h"
#include "core/region/neighborhood.h"
#include "core/region/relevance_table.h"
#include "core/region/settings.h"
#include "core/region/whole_islands.h"

namespace tessera::region {

class Relevance {
 public:
  // All that the relevance of a tick follows from.
  struct Inputs {
    const Bodies& bodies;
    const Neighborhood& neighborhood;
    std::span<const physics::Forces> forces;  // by owned body; unused without neighbours, or inland
    std::span<const DepartingBody> departing;
    std::span<const std::span<const GhostRecord>> sent;  // by neighbour, in its last frame
    std::span<const BodyId> hidden = {};                 // owned ones that take no part and that nobody is to see
    bool inland = false;                                 // AllInland holds: no body reaches a neighbour's cells
  };

  // `catalog` must outlive it.
  Relevance(const Catalog& catalog, const RegionSettings& settings, double tick_s);

  // Bodies must have noted their places.
  void Update(const Inputs& in);
  // Results of the last Update, by the index of the owned body.
  const RelevanceTable& table() const { return table_; }
  bool IsWhole(std::size_t body) const { return islands_.IsWhole(body); }
  // Whether the body has lain still for a while. Players' bodies never count, since they start without warning; nor
  // does one of a whole island, since all that bears it is there.
  bool IsSettled(std::size_t body, const OwnedBody& owned) const;

  void Validate(const Bodies& bodies) const;

 private:
  void MarkSwept(const Inputs& in);
  void MarkFirst(const Inputs& in);
  void MarkNearOthers(const Inputs& in);
  void MarkDeeper(const Inputs& in);
  void MarkLayer(const Bodies& bodies, std::size_t neighbor);
  void MarkSleepers(const Inputs& in);
  void MarkAssemblies(const Bodies& bodies);
  void CountStill(const Bodies& bodies);
  bool Moves(std::size_t body, const Bodies& bodies) const;

  const Catalog& catalog_;
  const double aura_m_, horizon_s_;
  const std::uint32_t ghost_depth_;
  RelevanceTable table_;
  WholeIslands islands_;
  BodyNotes<std::uint8_t> still_ticks_;  // up to kSettledTicks: for how long it has been relevant and hardly moved
  // Scratch of Update.
  std::vector<std::size_t> edge_, next_edge_;
  std::vector<std::uint32_t> places_;
};

}  // namespace tessera::region
