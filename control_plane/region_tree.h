// RegionTree: a partition as a tree of cuts, so that borders can be moved, regions split and merged, and every result
// still covers the world exactly once.
//
// Each inner node cuts its area in two by a line along x or z; each leaf is one region's cell. The tree is found back
// from any map whose cells can be separated by such cuts, which all maps here can: the grid, k-d trees, failovers of
// these.
//
//   auto tree = RegionTree::FromMap(map);
//   tree->Balance(loads, spreads, 0.25);            // every border moves a little towards the heavier side
//   tree->Split(RegionId(2), RegionId(5));          // 5 takes half of 2's largest cell
//   auto wanted = tree->ToMap(version, standbys);
//
// A value; no thread of its own. Same input, same tree.
#pragma once

#include <functional>
#include <map>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/partition_map.h"

namespace tessera::control {

using RegionLoads = std::map<RegionId, double>;  // in any unit; not negative

// Where a region's load lies: positions that split it into equal parts, ascending, the outermost first and last.
struct RegionSpread {
  std::vector<double> x, z;  // equally many, at least 2
};
using RegionSpreads = std::map<RegionId, RegionSpread>;  // a region that is not here is filled evenly

class RegionTree {
 public:
  // INVALID_ARGUMENT if the cells cannot be separated by cuts.
  static absl::StatusOr<RegionTree> FromMap(const PartitionMap& map);

  // `newcomer`, which owns nothing, takes one of the region's cells if it has several, else half of its only one, cut
  // across its longer side.
  void Split(RegionId region, RegionId newcomer);
  // The regions beside it in the tree grow over all its cells. The last region cannot be removed.
  void Remove(RegionId region);
  // The region whose removal adds least to another one's load: one of the lightest pair of neighbours in the tree.
  RegionId Lightest(const RegionLoads& loads) const;
  // `newcomer` takes the region's place.
  void Replace(RegionId region, RegionId newcomer);
  // Moves each cut to where both sides have the share of the load that they have of the cells, but into a side by at
  // most `most` (0 to 1) of its extent; no cell gets narrower than kNarrowest of the world's extent.
  void Balance(const RegionLoads& loads, const RegionSpreads& spreads, double most);

  std::vector<RegionId> Regions() const;  // ascending
  std::size_t Cells(RegionId region) const { return LeavesOf(region).size(); }
  // The first region on the other side of the region's nearest cut; itself if there is none.
  RegionId SiblingOf(RegionId region) const;
  // A settled map with epochs of 1; standbys as given where they are still regions.
  absl::StatusOr<PartitionMap> ToMap(MapVersion version, std::span<const MapRegion> standbys) const;

  static constexpr double kNarrowest = 0.02;

 private:
  struct TreeNode {
    Rect area;
    bool along_x = false;           // the cut is at an x; else at a z
    std::size_t low = 0, high = 0;  // children; 0 (the root, nobody's child): a leaf
    RegionId owner{};
    bool leaf() const { return low == 0; }
  };
  absl::Status Grow(std::size_t node, std::vector<Cell> cells);
  void Place(std::size_t node, const Rect& area);
  double Load(std::size_t node, const RegionLoads& loads) const;
  int Leaves(std::size_t node) const;
  std::vector<std::size_t> LeavesOf(RegionId region) const;
  std::size_t ParentOf(std::size_t node) const;
  using LoadIn = std::function<double(const Rect&)>;
  void BalanceNode(std::size_t node, const LoadIn& load_in, double most);
  double AreaShare(RegionId region, const Rect& rect) const;
  void RemoveLeaf(std::size_t leaf);

  Rect bounds_;
  std::vector<TreeNode> nodes_;  // the root first
};

// The busiest region's load by the mean; 1 if there is none.
double Imbalance(const RegionLoads& loads);

}  // namespace tessera::control
