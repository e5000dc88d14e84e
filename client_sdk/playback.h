// Playback: a recording that a client plays, with the notes that stand in it.
//
//   while (auto step = *playback.Next(now)) Play(*step);    // once a poll
//   playback.EndPoll(events);
//
// Promise: after a seek all that stood at that moment comes with the first poll, as if its client had just come to know
// that world; each property of the world is named once then, however often it had changed by then.
// Thread rule: one thread at a time; time comes in. Touches the file.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/client.h"
#include "client_sdk/replay.h"

namespace tessera::client {

class Playback {
 public:
  explicit Playback(Replay replay) : replay_(std::move(replay)) {}
  // The same recording, from this moment in it.
  Playback(Playback from, std::chrono::microseconds at);

  // As Replay.
  const Session& session() const { return replay_.session(); }
  const RecordingHeader& header() const { return replay_.header(); }
  std::chrono::microseconds length() const { return replay_.length(); }
  bool ended() const { return replay_.ended(); }

  absl::StatusOr<std::optional<Replay::Step>> Next(TimePoint now) { return replay_.Next(now); }
  // Whether the steps are those from before the moment that was sought: nobody saw the frames since then.
  bool catching_up() const { return catching_up_; }
  // All steps that are due have been played, with these events.
  void EndPoll(std::vector<ClientEvent>& events);
  // A step was a note.
  void AddNote(std::string text);
  // Notes since the last call; the newest of those that nobody has taken.
  std::vector<std::string> TakeNotes() { return std::exchange(notes_, {}); }

 private:
  static constexpr std::size_t kMaxNotes = 256;

  Replay replay_;
  bool catching_up_ = false;
  std::vector<std::string> notes_;
};

}  // namespace tessera::client
