#include "game_sdk/lua/spelling.h"

#include <algorithm>
#include <utility>

namespace tessera::game {

constexpr std::size_t kLongest = 40;

// The optimal string alignment distance, row by row.
std::size_t EditDistance(std::string_view from, std::string_view to) {
  from = from.substr(0, kLongest);
  to = to.substr(0, kLongest);
  std::size_t rows[3][kLongest + 1];
  std::size_t *before = rows[0], *last = rows[1], *row = rows[2];
  for (std::size_t j = 0; j <= to.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= from.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= to.size(); ++j) {
      const bool same = from[i - 1] == to[j - 1];
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && from[i - 1] == to[j - 2] && from[i - 2] == to[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::size_t* const free_row = before;
    before = last;
    last = row;
    row = free_row;
  }
  return last[to.size()];
}

// A third of the letters may be wrong: more, and the names have little in common.
Suggestion::Suggestion(std::string_view wanted) : wanted_(wanted), distance_(wanted.size() / 3 + 2) {}

void Suggestion::Offer(std::string_view name) {
  const std::size_t distance = EditDistance(wanted_, name);
  if (distance > distance_ || (distance == distance_ && (best_.empty() || best_ <= name))) return;
  if (distance >= std::min(name.size(), wanted_.size())) return;
  best_ = name;
  distance_ = distance;
}

}  // namespace tessera::game
