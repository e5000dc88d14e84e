// Replay: gives a client the entries of a recording at the pace at which they were made.
//
//   auto replay = Replay::Open("match.tsr");
//   while (auto due = *replay->Next(now)) Take(due->at, due->what);       // everything that is due by then
//
// Thread rule: one thread at a time; time comes in.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "client_sdk/recording.h"
#include "client_sdk/session.h"
#include "core/replication/codec/dense_codec.h"

namespace tessera::client {

class Replay {
 public:
  struct Snapshot {
    RegionId region;
    replication::ReceivedSnapshot received;
  };
  // Where playing begins in the middle: what stood then, but for the bodies, which follow.
  struct Standing {
    bool started = false;
    PartitionMap map;
    std::vector<std::pair<RegionId, bool>> regions;  // whether it was connected
    PropertySet world;
  };
  // Properties of the world that differ from the scene's, from now on.
  struct World {
    PropertySet changed;
  };
  struct Step {
    TimePoint at;
    std::variant<Snapshot, RegionEntry, PartitionMap, ClientEvent, Standing, NoteEntry, World> what;
  };

  // Errors: those of RecordingReader::Open; INVALID_ARGUMENT or DATA_LOSS where the scene or the map in it is none.
  static absl::StatusOr<Replay> Open(const std::string& file);
  static absl::StatusOr<Replay> Open(RecordingReader reader, const std::string& name);

  // The session of the recorded client; no regions to dial, no credentials.
  const Session& session() const { return session_; }
  const RecordingHeader& header() const { return reader_.header(); }
  std::chrono::microseconds length() const { return reader_.length(); }

  // The next call of Next is at this time of the recording, and gives what stood at the last key before it, and all
  // since: to a client that knows nothing yet. At most length().
  void Seek(std::chrono::microseconds at);

  // The next entry if its time has come by `now`; the first call is the beginning. Errors: DATA_LOSS (malformed).
  absl::StatusOr<std::optional<Step>> Next(TimePoint now);
  bool ended() const { return ended_; }

 private:
  Replay(RecordingReader reader, std::string name, Session session);
  absl::StatusOr<std::optional<Step>> StepOf(RecordedEntry entry);
  absl::StatusOr<Snapshot> Decode(const FrameEntry& entry);

  RecordingReader reader_;
  std::string name_;
  Session session_;
  replication::Quantizer quantizer_;
  replication::DenseCodec codec_;
  std::optional<TimePoint> begin_;
  std::optional<RecordedEntry> next_;
  bool ended_ = false;
  std::chrono::microseconds from_{};                                // where the first call of Next is
  bool knows_nothing_ = false;                                      // nor do those to whom the steps are given
  std::map<RegionId, replication::DenseCodec::References> frames_;  // the last three of each
};

}  // namespace tessera::client
