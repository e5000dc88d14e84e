// RelevanceTable: which owned bodies are relevant to which neighbours, in one tick.
//
// Bodies and neighbours are named by their indices. Thread rule: one thread at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace tessera::region {

class RelevanceTable {
 public:
  // Starts over: no body is relevant to anyone.
  void Reset(std::size_t bodies, std::size_t neighbors) {
    neighbors_ = neighbors;
    bits_.assign(bodies * neighbors, 0);
  }
  std::size_t neighbors() const { return neighbors_; }

  void Mark(std::size_t body, std::size_t neighbor) { bits_[body * neighbors_ + neighbor] = 1; }
  // The body is relevant to nobody after all.
  void Clear(std::size_t body) {
    std::fill_n(bits_.begin() + static_cast<std::ptrdiff_t>(body * neighbors_), neighbors_, std::uint8_t{0});
  }
  bool To(std::size_t body, std::size_t neighbor) const { return bits_[body * neighbors_ + neighbor] != 0; }
  bool ToAny(std::size_t body) const {
    const auto row = Row(body);
    return std::find(row.begin(), row.end(), 1) != row.end();
  }
  // Whether both are relevant to the same neighbours.
  bool Alike(std::size_t a, std::size_t b) const {
    const auto row = Row(a);
    return std::equal(row.begin(), row.end(), Row(b).begin());
  }
  // Whether anything is relevant to anyone.
  bool Any() const { return !bits_.empty() && std::memchr(bits_.data(), 1, bits_.size()) != nullptr; }
  // A neighbour that one of these bodies is relevant to needs all of them.
  void Unite(std::span<const std::size_t> bodies) {
    for (std::size_t n = 0; n < neighbors_; ++n) {
      if (std::none_of(bodies.begin(), bodies.end(), [&](std::size_t body) { return To(body, n); })) continue;
      for (const std::size_t body : bodies) Mark(body, n);
    }
  }

 private:
  std::span<const std::uint8_t> Row(std::size_t body) const {
    return std::span(bits_).subspan(body * neighbors_, neighbors_);
  }

  std::size_t neighbors_ = 0;
  std::vector<std::uint8_t> bits_;  // bodies by neighbours
};

}  // namespace tessera::region
