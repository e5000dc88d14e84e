#include "tests/simulation/surroundings.h"

#include "absl/status/status.h"

namespace tessera::simulation {

absl::StatusOr<Bytes> Surroundings::FileAt(const std::string& path) const {
  const auto file = files.find(path);
  if (file == files.end()) return absl::NotFoundError(path);
  return file->second;
}

std::string Surroundings::GameOnHostOf(RegionId region, const std::string& hash) const {
  const auto next = next_games.find(hash);
  const std::string& whole = next == next_games.end() ? game : next->second;
  return damaged_games.contains(region) ? whole + " rust" : whole;
}

}  // namespace tessera::simulation
