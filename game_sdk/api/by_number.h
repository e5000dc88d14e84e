// Where the entries of a table stand, by their numbers and by their names: for the tables of api.h.
//
// Thread rule: constants.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <span>
#include <string_view>

#include "game_sdk/api/api.h"

namespace tessera::game {

template <class Entry>
const Entry* Named(std::span<const Entry> entries, Receiver receiver, std::string_view name) {
  const auto found = std::ranges::find_if(
      entries, [&](const Entry& entry) { return entry.receiver == receiver && entry.name == name; });
  return found == entries.end() ? nullptr : &*found;
}

// Where the entry of each number stands in its table, counted from 1; 0: nowhere. Every call of a game looks it up.
template <const auto& entries>
constexpr auto PlacesByNumber() {
  std::array<std::uint8_t, std::end(entries)[-1].number + 1> places{};
  for (std::size_t i = 0; i < std::size(entries); ++i) places[entries[i].number] = static_cast<std::uint8_t>(i + 1);
  return places;
}

template <class Entry, std::size_t kNumbers>
const Entry* Numbered(const Entry* entries, const std::array<std::uint8_t, kNumbers>& places, std::uint32_t number) {
  return number < kNumbers && places[number] != 0 ? entries + places[number] - 1 : nullptr;
}

}  // namespace tessera::game
