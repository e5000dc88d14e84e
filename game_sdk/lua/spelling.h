// Finds the known name that a misspelt one was probably meant to be.
//
// Thread rule: functions of their arguments.
#pragma once

#include <cstddef>
#include <string_view>

namespace tessera::game {

// Number of letters to insert, take out, replace or swap with their neighbour; names are compared up to 40 bytes.
std::size_t EditDistance(std::string_view from, std::string_view to);

// The name nearest to `wanted` among those that are offered, if one is near enough; the first by bytes of equal ones.
class Suggestion {
 public:
  explicit Suggestion(std::string_view wanted);
  void Offer(std::string_view name);  // keeps the view
  std::string_view best() const { return best_; }

 private:
  std::string_view wanted_, best_;
  std::size_t distance_;
};

}  // namespace tessera::game
