#include "control_plane/region_tree.h"

#include <algorithm>
#include <limits>
#include <set>

namespace tessera::control {
namespace {

double Low(const Rect& rect, bool along_x) { return along_x ? rect.min_x : rect.min_z; }
double High(const Rect& rect, bool along_x) { return along_x ? rect.max_x : rect.max_z; }
double Extent(const Rect& rect, bool along_x) { return High(rect, along_x) - Low(rect, along_x); }
double Area(const Rect& rect) { return Extent(rect, true) * Extent(rect, false); }

// The part of `rect` below, or above, the cut.
Rect Side(Rect rect, bool along_x, double cut, bool below) {
  (along_x ? (below ? rect.max_x : rect.min_x) : (below ? rect.max_z : rect.min_z)) = cut;
  return rect;
}

struct Cut {
  bool found = false, along_x = false;
  double at = 0;
  std::size_t uneven = 0;  // by how many cells the sides differ
};

// The most even cut that goes through no cell.
Cut BestCut(const Rect& area, const std::vector<Cell>& cells) {
  Cut best;
  for (const bool along_x : {true, false}) {
    std::set<double> edges;
    for (const Cell& cell : cells) edges.insert(Low(cell.area, along_x));
    for (const double at : edges) {
      if (at <= Low(area, along_x)) continue;
      std::size_t below = 0, above = 0;
      for (const Cell& cell : cells) {
        below += High(cell.area, along_x) <= at ? 1 : 0;
        above += Low(cell.area, along_x) >= at ? 1 : 0;
      }
      if (below + above != cells.size()) continue;
      const std::size_t uneven = below > above ? below - above : above - below;
      if (!best.found || uneven < best.uneven) best = {true, along_x, at, uneven};
    }
  }
  return best;
}

constexpr int kHalvings = 40;  // bring a cut to a millimetre and below in any world

// The share of a load that is spread so that lies below `at`, 0 to 1.
double ShareBelow(const std::vector<double>& spread, double at) {
  if (at <= spread.front()) return 0;
  if (at >= spread.back()) return 1;
  const auto above = std::upper_bound(spread.begin(), spread.end(), at);
  const auto part = static_cast<double>(above - spread.begin() - 1);
  const double from = *(above - 1), to = *above;
  return (part + (at - from) / (to - from)) / static_cast<double>(spread.size() - 1);
}

double ShareIn(const std::vector<double>& spread, double from, double to) {
  return ShareBelow(spread, to) - ShareBelow(spread, from);
}

}  // namespace

double Imbalance(const RegionLoads& loads) {
  double sum = 0, most = 0;
  for (const auto& [region, load] : loads) {
    sum += load;
    most = std::max(most, load);
  }
  return sum > 0 ? most * static_cast<double>(loads.size()) / sum : 1;
}

absl::StatusOr<RegionTree> RegionTree::FromMap(const PartitionMap& map) {
  RegionTree tree;
  tree.bounds_ = map.bounds();
  tree.nodes_.push_back({.area = map.bounds()});
  const absl::Status status = tree.Grow(0, {map.cells().begin(), map.cells().end()});
  if (!status.ok()) return status;
  return tree;
}

absl::Status RegionTree::Grow(std::size_t node, std::vector<Cell> cells) {
  if (cells.size() == 1) {
    nodes_[node].owner = cells.front().owner;
    return absl::OkStatus();
  }
  const Rect area = nodes_[node].area;
  const Cut cut = BestCut(area, cells);
  if (!cut.found) return absl::InvalidArgumentError("map: its cells cannot be separated by straight cuts");
  const auto first_above = std::stable_partition(
      cells.begin(), cells.end(), [&](const Cell& cell) { return High(cell.area, cut.along_x) <= cut.at; });
  std::vector<Cell> above(first_above, cells.end());
  cells.erase(first_above, cells.end());
  const std::size_t low = nodes_.size(), high = low + 1;
  nodes_[node].along_x = cut.along_x;
  nodes_[node].low = low;
  nodes_[node].high = high;
  nodes_.push_back({.area = Side(area, cut.along_x, cut.at, true)});
  nodes_.push_back({.area = Side(area, cut.along_x, cut.at, false)});
  if (absl::Status status = Grow(low, std::move(cells)); !status.ok()) return status;
  return Grow(high, std::move(above));
}

// The node fills `area`; the cuts inside keep their proportions.
void RegionTree::Place(std::size_t node, const Rect& area) {
  const Rect old = nodes_[node].area;
  nodes_[node].area = area;
  if (nodes_[node].leaf()) return;
  const bool along_x = nodes_[node].along_x;
  const double at = High(nodes_[nodes_[node].low].area, along_x);
  const bool same = Low(old, along_x) == Low(area, along_x) && High(old, along_x) == High(area, along_x);
  const double share = (at - Low(old, along_x)) / Extent(old, along_x);
  const double cut = same ? at : Low(area, along_x) + share * Extent(area, along_x);
  Place(nodes_[node].low, Side(area, along_x, cut, true));
  Place(nodes_[node].high, Side(area, along_x, cut, false));
}

double RegionTree::Load(std::size_t node, const RegionLoads& loads) const {
  const TreeNode& at = nodes_[node];
  if (!at.leaf()) return Load(at.low, loads) + Load(at.high, loads);
  const auto found = loads.find(at.owner);
  if (found == loads.end()) return 0;
  double area = 0;  // all its cells together: the load is shared by area
  for (const std::size_t leaf : LeavesOf(at.owner)) area += Area(nodes_[leaf].area);
  return found->second * Area(at.area) / area;
}

int RegionTree::Leaves(std::size_t node) const {
  return nodes_[node].leaf() ? 1 : Leaves(nodes_[node].low) + Leaves(nodes_[node].high);
}

std::vector<std::size_t> RegionTree::LeavesOf(RegionId region) const {
  std::vector<std::size_t> leaves;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i].leaf() && nodes_[i].owner == region) leaves.push_back(i);
  }
  return leaves;
}

std::size_t RegionTree::ParentOf(std::size_t node) const {
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (!nodes_[i].leaf() && (nodes_[i].low == node || nodes_[i].high == node)) return i;
  }
  return node;  // the root
}

std::vector<RegionId> RegionTree::Regions() const {
  std::set<RegionId> regions;
  for (const TreeNode& node : nodes_) {
    if (node.leaf()) regions.insert(node.owner);
  }
  return {regions.begin(), regions.end()};
}

RegionId RegionTree::SiblingOf(RegionId region) const {
  const std::vector<std::size_t> leaves = LeavesOf(region);
  if (leaves.empty() || leaves.front() == 0) return region;
  const TreeNode& parent = nodes_[ParentOf(leaves.front())];
  std::size_t node = parent.low == leaves.front() ? parent.high : parent.low;
  while (!nodes_[node].leaf()) node = nodes_[node].low;
  return nodes_[node].owner;
}

void RegionTree::Split(RegionId region, RegionId newcomer) {
  std::vector<std::size_t> leaves = LeavesOf(region);
  if (leaves.empty()) return;
  const auto larger = [this](std::size_t a, std::size_t b) { return Area(nodes_[a].area) < Area(nodes_[b].area); };
  const std::size_t largest = *std::max_element(leaves.begin(), leaves.end(), larger);
  if (leaves.size() > 1) {
    nodes_[largest].owner = newcomer;
    return;
  }
  const Rect area = nodes_[largest].area;
  const bool along_x = Extent(area, true) >= Extent(area, false);
  const double cut = Low(area, along_x) + Extent(area, along_x) / 2;
  nodes_[largest].along_x = along_x;
  nodes_[largest].low = nodes_.size();
  nodes_[largest].high = nodes_.size() + 1;
  nodes_.push_back({.area = Side(area, along_x, cut, true), .owner = region});
  nodes_.push_back({.area = Side(area, along_x, cut, false), .owner = newcomer});
}

void RegionTree::Replace(RegionId region, RegionId newcomer) {
  for (const std::size_t leaf : LeavesOf(region)) nodes_[leaf].owner = newcomer;
}

// The leaf's sibling takes its area and its parent's place. Nodes that nobody refers to any more are dropped.
void RegionTree::RemoveLeaf(std::size_t leaf) {
  const std::size_t parent = ParentOf(leaf);
  const std::size_t sibling = nodes_[parent].low == leaf ? nodes_[parent].high : nodes_[parent].low;
  Place(sibling, nodes_[parent].area);
  const TreeNode taken = nodes_[sibling];
  nodes_[parent] = taken;
  std::vector<TreeNode> kept;
  const auto copy = [&](auto&& self, std::size_t from) -> std::size_t {
    const std::size_t to = kept.size();
    kept.push_back(nodes_[from]);
    if (nodes_[from].leaf()) return to;
    const std::size_t low = self(self, nodes_[from].low), high = self(self, nodes_[from].high);
    kept[to].low = low;
    kept[to].high = high;
    return to;
  };
  copy(copy, 0);
  nodes_ = std::move(kept);
}

void RegionTree::Remove(RegionId region) {
  while (Regions().size() > 1) {
    const std::vector<std::size_t> leaves = LeavesOf(region);
    if (leaves.empty()) return;
    RemoveLeaf(leaves.front());
  }
}

RegionId RegionTree::Lightest(const RegionLoads& loads) const {
  RegionId lightest;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (!nodes_[i].leaf()) continue;
    const double load = Load(ParentOf(i), loads);
    // The higher id of a pair goes, so that growing and shrinking again leads back.
    if (load < least || (load == least && nodes_[i].owner > lightest)) {
      least = load;
      lightest = nodes_[i].owner;
    }
  }
  return lightest;
}

void RegionTree::BalanceNode(std::size_t node, const LoadIn& load_in, double most) {
  if (nodes_[node].leaf()) return;
  const bool along_x = nodes_[node].along_x;
  const std::size_t low = nodes_[node].low, high = nodes_[node].high;
  const Rect area = nodes_[node].area;
  const double old = High(nodes_[low].area, along_x), room = kNarrowest * Extent(bounds_, along_x);
  double least = std::max(Low(area, along_x) + room * Leaves(low), old - most * Extent(nodes_[low].area, along_x));
  double greatest =
      std::min(High(area, along_x) - room * Leaves(high), old + most * Extent(nodes_[high].area, along_x));
  const double wanted = load_in(area) * Leaves(low) / Leaves(node);
  if (wanted > 0 && least < greatest) {
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = least + (greatest - least) / 2;
      (load_in(Side(area, along_x, middle, true)) < wanted ? least : greatest) = middle;
    }
    Place(low, Side(area, along_x, greatest, true));
    Place(high, Side(area, along_x, greatest, false));
  }
  BalanceNode(low, load_in, most);
  BalanceNode(high, load_in, most);
}

// All cuts move at once, by how things lie now: a cut that moves changes what its neighbours on both sides have.
void RegionTree::Balance(const RegionLoads& loads, const RegionSpreads& spreads, double most) {
  const RegionTree before = *this;
  const auto load_in = [&](const Rect& rect) {
    double sum = 0;
    for (const auto& [region, load] : loads) {
      const auto spread = spreads.find(region);
      sum += load * (spread == spreads.end() ? before.AreaShare(region, rect)
                                             : ShareIn(spread->second.x, rect.min_x, rect.max_x) *
                                                   ShareIn(spread->second.z, rect.min_z, rect.max_z));
    }
    return sum;
  };
  BalanceNode(0, load_in, most);
}

// The share of the region's area that lies in `rect`.
double RegionTree::AreaShare(RegionId region, const Rect& rect) const {
  double all = 0, inside = 0;
  for (const std::size_t leaf : LeavesOf(region)) {
    const Rect& cell = nodes_[leaf].area;
    const double along_x = std::min(cell.max_x, rect.max_x) - std::max(cell.min_x, rect.min_x);
    const double along_z = std::min(cell.max_z, rect.max_z) - std::max(cell.min_z, rect.min_z);
    all += Area(cell);
    inside += std::max(along_x, 0.0) * std::max(along_z, 0.0);
  }
  return all > 0 ? inside / all : 0;
}

absl::StatusOr<PartitionMap> RegionTree::ToMap(MapVersion version, std::span<const MapRegion> standbys) const {
  const std::vector<RegionId> ids = Regions();
  std::vector<MapRegion> regions;
  regions.reserve(ids.size());
  for (const RegionId id : ids) {
    const auto old = std::find_if(standbys.begin(), standbys.end(), [id](const MapRegion& r) { return r.id == id; });
    const bool lives = old != standbys.end() && std::binary_search(ids.begin(), ids.end(), old->standby);
    regions.push_back({id, lives ? old->standby : RegionId()});
  }
  std::vector<Cell> cells;
  for (const TreeNode& node : nodes_) {
    if (node.leaf()) cells.push_back({node.area, node.owner, Epoch(1)});
  }
  return PartitionMap::Create(version, bounds_, std::move(cells), std::move(regions));
}

}  // namespace tessera::control
