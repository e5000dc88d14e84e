// WholeIslands: which islands across a border are relevant as a whole, so that all who take part in one solve the same.
//
// Bodies whose bounds are about each other's belong to one island, be it through bodies of others; so do jointed ones.
// If a region has little of an island, all of that is relevant to every neighbour that any part of it is relevant to
// or comes near, whoever owns that part. So around a corner, over a narrow region or over a bridge that a third region
// owns, all regions that take part in the island have all of it, and solve it alike. An island that is near the border
// with all its bodies is whole whatever its size.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "core/region/bodies.h"
#include "core/region/catalog.h"
#include "core/region/neighborhood.h"
#include "core/region/relevance_table.h"

namespace tessera::region {

class WholeIslands {
 public:
  // `most` is how many bodies a region may own of an island that is relevant as a whole; below 2, none is. `catalog`
  // must outlive it.
  WholeIslands(const Catalog& catalog, std::uint32_t most) : catalog_(catalog), most_(most) {}

  // Finds the islands of the bodies that are relevant to anyone, and marks the rest of them.
  void Mark(const Bodies& bodies, const Neighborhood& neighborhood, RelevanceTable& table);
  // Whether the island of an owned body was found to be whole by the last Mark.
  bool IsWhole(std::size_t body) const { return whole_[body]; }

  void Validate(const Bodies& bodies) const;

 private:
  enum State : std::uint8_t { kUnknown, kFound, kTooMany };
  struct Island {
    std::vector<std::size_t> places;  // all that was found of it
    std::vector<std::size_t> owned;   // those of them that are owned here
    bool too_many = false;
  };
  void Search(std::size_t first, const Bodies& bodies, const RelevanceTable& table);
  void AddNext(std::size_t place, const Bodies& bodies);

  const Catalog& catalog_;
  const std::uint32_t most_;
  std::vector<bool> whole_;  // by owned body
  // Scratch of Mark.
  std::vector<State> states_;  // by place
  std::vector<std::uint32_t> near_;
  Island island_;
};

// Marks `body` for each neighbour whose cells `bounds` come near.
void MarkAround(std::size_t body, const Aabb& bounds, const Neighborhood& neighborhood, RelevanceTable& table);

}  // namespace tessera::region
