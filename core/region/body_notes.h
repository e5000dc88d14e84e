// BodyNotes: what one part of a region keeps about each owned body, from tick to tick.
//
// Promise: after Align the note at an index is that of the owned body there. A body keeps its note as long as this
// region owns it; one that came, or came back, has a fresh one. Thread rule: one thread at a time.
#pragma once

#include <cassert>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/region/ascends.h"
#include "core/region/bodies.h"

namespace tessera::region {

template <class Note>
class BodyNotes {
 public:
  void Align(const Bodies& bodies) {
    if (revision_ == bodies.ownership_revision()) return;
    revision_ = bodies.ownership_revision();
    std::vector<Key> keys;
    std::vector<Note> notes(bodies.owned().size());
    keys.reserve(bodies.owned().size());
    std::size_t old = 0;
    for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
      const Key key{bodies.owned_ids()[i], bodies.owned()[i].epoch};
      while (old < keys_.size() && keys_[old].first < key.first) ++old;
      if (old < keys_.size() && keys_[old] == key) notes[keys.size()] = std::move(notes_[old]);
      keys.push_back(key);
    }
    keys_ = std::move(keys);
    notes_ = std::move(notes);
  }

  std::size_t size() const { return notes_.size(); }
  Note& operator[](std::size_t index) { return notes_[index]; }
  const Note& operator[](std::size_t index) const { return notes_[index]; }
  auto begin() { return notes_.begin(); }
  auto end() { return notes_.end(); }

  void Validate() const { assert(notes_.size() == keys_.size() && Ascends(keys_)); }

 private:
  using Key = std::pair<BodyId, Epoch>;  // the epoch distinguishes one ownership of a body from another

  std::uint64_t revision_ = 0;  // no body, no note
  std::vector<Key> keys_;
  std::vector<Note> notes_;
};

}  // namespace tessera::region
