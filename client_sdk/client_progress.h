// ClientProgress: how far a client has come, and when it gives up.
//
//   JOINING -all regions have welcomed it, the scene is here-> WAITING -started-> PLAYING
//   any -End-> ENDED
//
//   const ClientProgress::Due due = progress.Look(now, seen);   // once a poll
//   if (due.lost) End(...);
//
// Joining has a deadline, which begins anew while the scene comes. After it a client goes through silences: soon it
// searches for other regions, then asks for a grant that knows where they are, and at last it counts the instance as
// lost.
// Pure: time comes in. Thread rule: one thread at a time.
#pragma once

#include <chrono>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "client_sdk/client.h"

namespace tessera::client {

class ClientProgress {
 public:
  // A region of which nothing came for so long counts as silent, though its connection may last for some seconds more:
  // twice the time between two pings.
  static constexpr std::chrono::milliseconds kHeardWithin{1000};
  // After so long without an answer all regions of the map are dialled: the regions that replace those that were near
  // may lie elsewhere.
  static constexpr std::chrono::seconds kSearchAfter{1};
  // After so long none of the addresses that the client knows leads anywhere, as far as it can tell: with the time
  // before it longer than a failover takes.
  static constexpr std::chrono::milliseconds kAskForGrantAfter{500};
  // Without any region for so long, the instance counts as lost; shorter than that, a failover may bring it back.
  static constexpr std::chrono::seconds kMaxSilence{30};

  explicit ClientProgress(std::chrono::milliseconds deadline) : deadline_(deadline) {}

  ClientState state() const { return state_; }
  bool ended() const { return state_ == ClientState::kEnded; }
  bool started() const { return started_; }
  const absl::Status& reason() const { return reason_; }
  bool needs_new_grant() const { return needs_new_grant_; }

  // A step of joining was made: the deadline begins anew.
  void Step(TimePoint now) { joined_by_ = now + deadline_; }
  // The deadline begins with the next Look.
  void BeginJoining() { joined_by_.reset(); }
  // The world has started. False: that was known.
  bool Start() { return !std::exchange(started_, true); }
  // For a recording: how far the world is.
  void Stand(bool started);
  // The silence is over, as far as can be known: there are new addresses.
  void EndSilence();
  // False: it had ended before, by what counts.
  bool End(absl::Status why, bool needs_new_grant = false);

  struct Seen {
    bool scene = false;         // it is here
    bool all_welcomed = false;  // by all regions that it is connected to
    bool any_heard = false;     // one that has welcomed it has been heard of in time
  };
  struct Due {
    bool late = false;       // the time to join is over
    bool search = false;     // all regions of the map are to be asked
    bool ask_grant = false;  // another grant is needed
    bool lost = false;       // no region answers any more
  };
  Due Look(TimePoint now, const Seen& seen);

 private:
  std::chrono::milliseconds deadline_;
  ClientState state_ = ClientState::kJoining;
  bool started_ = false;
  std::optional<TimePoint> joined_by_, silent_since_;
  bool asked_for_grant_ = false;  // in the present silence
  absl::Status reason_;
  bool needs_new_grant_ = false;
};

}  // namespace tessera::client
