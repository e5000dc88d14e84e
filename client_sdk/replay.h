// Replay: a recording as a client takes it in, at the pace at which it was made.
//
//   auto replay = Replay::Open("match.tsr");
//   while (auto due = *replay->Next(now)) Take(due->at, due->what);       // all that had come by then
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
    replication::ReceivedSnapshot told;
  };
  struct Step {
    TimePoint at;
    std::variant<Snapshot, RegionEntry, PartitionMap, ClientEvent> what;
  };

  // Errors: those of RecordingReader::Open; INVALID_ARGUMENT or DATA_LOSS where the scene or the map in it is none.
  static absl::StatusOr<Replay> Open(const std::string& file);
  static absl::StatusOr<Replay> Open(RecordingReader reader, const std::string& name);

  // What the client that was recorded knew when it joined; no regions to dial, no credentials.
  const Session& session() const { return session_; }
  const RecordingHeader& header() const { return reader_.header(); }
  std::chrono::microseconds length() const { return reader_.length(); }

  // What comes next, if it had come by `now`; the first call is the beginning. DATA_LOSS where it makes no sense.
  absl::StatusOr<std::optional<Step>> Next(TimePoint now);
  bool ended() const { return ended_; }

 private:
  Replay(RecordingReader reader, std::string name, Session session);
  absl::StatusOr<Step> StepOf(RecordedEntry entry);
  absl::StatusOr<Snapshot> Decode(const FrameEntry& entry);

  RecordingReader reader_;
  std::string name_;
  Session session_;
  replication::Quantizer quantizer_;
  replication::DenseCodec codec_;
  std::optional<TimePoint> begin_;
  std::optional<RecordedEntry> next_;
  bool ended_ = false;
  std::map<RegionId, replication::DenseCodec::References> frames_;  // the last three of each
};

}  // namespace tessera::client
