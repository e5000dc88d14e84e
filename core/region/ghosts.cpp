#include "core/region/ghosts.h"

#include <algorithm>

namespace tessera::region {
namespace {

struct Candidate {
  BodyId id;
  Epoch epoch;
  RegionId owner;
  const GhostRecord* reported = nullptr;  // null: goes on by what this region made of it
};

// One for each body, ascending.
std::vector<Candidate> Candidates(std::span<const BorderFrame> frames, std::span<const RegionId> neighbors,
                                  absl::FunctionRef<bool(std::size_t)> link_up, const Bodies& bodies) {
  std::vector<Candidate> candidates;
  for (std::size_t n = 0; n < frames.size(); ++n) {
    for (const GhostRecord& record : frames[n].ghosts) {
      if (!bodies.Owns(record.id)) candidates.push_back({record.id, record.epoch, neighbors[n], &record});
    }
    if (link_up(n)) continue;
    for (const Ghost& ghost : bodies.ghosts()) {
      if (ghost.owner == neighbors[n]) candidates.push_back({ghost.record.id, ghost.record.epoch, ghost.owner});
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.id != b.id ? a.id < b.id : a.epoch > b.epoch;
  });
  const auto same = [](const Candidate& a, const Candidate& b) { return a.id == b.id; };
  candidates.erase(std::unique(candidates.begin(), candidates.end(), same), candidates.end());
  return candidates;
}

}  // namespace

std::vector<Ghost> GhostsFrom(std::span<const BorderFrame> frames, std::span<const RegionId> neighbors,
                              absl::FunctionRef<bool(std::size_t)> link_up, const Bodies& bodies) {
  const std::vector<Candidate> candidates = Candidates(frames, neighbors, link_up, bodies);
  std::vector<Ghost> ghosts;
  ghosts.reserve(candidates.size());
  for (const Candidate& one : candidates) {
    Ghost& ghost = ghosts.emplace_back(Ghost{.record = {}, .owner = one.owner, .reported = one.reported != nullptr});
    if (one.reported != nullptr) {
      ghost.record = *one.reported;
    } else {
      ghost.record.id = one.id;
      ghost.record.epoch = one.epoch;
      ghost.record.state = bodies.world().StateOf(one.id);
    }
  }
  return ghosts;
}

}  // namespace tessera::region
