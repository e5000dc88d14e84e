// PlayerView: what a player in a process of its own has said of itself, line by line.
//
//   PlayerView view;
//   if (absl::Status status = view.Take(InLine(BodyId(1u << 20), Tick(30))); !status.ok()) ...
//   view.body()
//
// The lines are between two processes of one program, so they have no version. Thread rule: none of its own; pure.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "core/world/ids.h"

namespace tessera::bench {

// A body as a player was shown it.
struct SeenPlace {
  Tick tick;
  RegionId region;
  double x = 0, y = 0, z = 0;  // m
  double speed = 0;            // m/s

  friend bool operator==(const SeenPlace&, const SeenPlace&) = default;
};

// Counts since the player's first frame.
struct FrameCount {
  std::uint64_t due = 0, late = 0;
};

// How long the bodies of some regions stood still for this player.
struct SeenGap {
  std::uint64_t watch = 0;    // number of the order to watch them
  std::uint64_t watched = 0;  // bodies of those regions that it was shown
  bool over = false;          // most of them are shown by another region
  double seconds = 0;         // if over: the median over the bodies
};

// The lines, without their ends.
std::string InLine(BodyId body, Tick tick);
std::string FramesLine(const FrameCount& frames);
std::string SeesLine(BodyId body, const SeenPlace& place);
std::string AllSeenLine();
std::string GapLine(const SeenGap& gap);
std::string EndedLine(const std::string& reason);

class PlayerView {
 public:
  // INVALID_ARGUMENT: no such line; nothing has changed then.
  absl::Status Take(std::string_view line);
  // By order number `watch` it watches other regions: what it says of earlier ones does not count any more.
  void WatchAnew(std::uint64_t watch) { gap_ = {.watch = watch}; }
  // Nothing more will come of it.
  void End(const std::string& reason);

  // Empty until it sees its own body in the world.
  std::optional<BodyId> body() const { return body_; }
  Tick tick() const { return tick_; }  // when it was first seen
  const FrameCount& frames() const { return frames_; }
  const SeenGap& gap() const { return gap_; }
  // Bodies of its last complete look around.
  const std::map<BodyId, SeenPlace>& sees() const { return sees_; }
  bool ended() const { return reason_.has_value(); }
  std::string reason() const { return reason_.value_or(""); }

 private:
  std::optional<BodyId> body_;
  Tick tick_;
  FrameCount frames_;
  SeenGap gap_;
  std::map<BodyId, SeenPlace> sees_, looking_;
  std::optional<std::string> reason_;
};

}  // namespace tessera::bench
