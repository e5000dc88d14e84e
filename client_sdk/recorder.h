// Recorder: gathers what regions send to a client into frames, and writes them.
//
// Each tick of a region becomes one frame, coded by the dense coder against the region's frames before it. A late
// record goes into its own frame for kHold, after that into the next one, so that no record is missing in the end.
// Every kKeyInterval, and not before as many bytes as the last key took, a key says all that is known.
//
//   recorder.Snapshot(now, region, snapshot);  recorder.Region(now, region, change);  recorder.Event(now, event);
//   if (absl::Status status = recorder.Flush(now); !status.ok()) ...    // once a poll
//   recorder.Close();
//
// Thread rule: one thread at a time; time comes in.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "client_sdk/recording.h"
#include "core/replication/codec/dense_codec.h"
#include "core/world/scene.h"

namespace tessera::client {

class Recorder {
 public:
  // How long a frame waits for datagrams that are late.
  static constexpr std::chrono::milliseconds kHold{200};

  static constexpr std::chrono::seconds kKeyInterval{5};

  // The recording begins with the first call of the others. `header`: what the writer has begun with.
  Recorder(RecordingWriter writer, const Scene& scene, const RecordingHeader& header);

  void Snapshot(TimePoint now, RegionId region, const replication::ReceivedSnapshot& snapshot);
  void Region(TimePoint now, RegionId region, RegionEntry::Change change);
  void Map(TimePoint now, std::string map);
  void Event(TimePoint now, const ClientEvent& event);
  void Note(TimePoint now, std::string text);
  // The world's properties from now on: PropertySet::Encode.
  void World(TimePoint now, replication::Bytes properties);
  std::uint64_t bytes() const { return writer_.bytes(); }

  // Writes what need not wait any more. Errors: those of RecordingWriter::Write; nothing more is written then.
  absl::Status Flush(TimePoint now);
  // Writes all, and what makes the file whole; the recorder is at its end.
  absl::Status Close();

 private:
  struct RecordedBody {
    Tick tick;
    Epoch epoch;
    replication::QuantizedState state;
    std::uint8_t jumps = 0;
  };
  struct Departed {
    Tick tick;
    Epoch epoch;
  };
  // The state of a region in the newest frame that is written.
  struct Stream {
    std::map<BodyId, RecordedBody> bodies;
    std::map<BodyId, Departed> gone;
    std::map<BodyId, std::shared_ptr<const replication::Bytes>> properties;  // the newest of each
    std::uint32_t last_input = 0;
    Tick written;
    replication::DenseCodec::References frames{};  // the last three
  };
  struct OpenFrame {
    RegionId region;
    Tick tick;
    std::uint32_t last_input = 0;
    std::map<BodyId, RecordedBody> bodies;
    std::map<BodyId, std::pair<Tick, std::shared_ptr<const replication::Bytes>>> properties;
    std::vector<replication::DepartureRecord> departures;
  };
  struct Waiting {
    TimePoint at;
    std::variant<OpenFrame, RegionEntry, MapEntry, ClientEvent, NoteEntry, WorldEntry> what;
  };

  void Wait(Waiting waiting);
  std::chrono::microseconds Since(TimePoint at) const;  // the beginning
  OpenFrame& FrameOf(TimePoint now, RegionId region, Tick tick);
  absl::Status WriteWaiting(std::optional<TimePoint> now);  // nothing: all of it
  absl::Status Write(Waiting waiting);
  absl::Status WriteKeyIfDue(std::chrono::microseconds at);
  static void Merge(Stream& stream, OpenFrame& frame);
  FrameEntry Encode(OpenFrame frame);
  void EncodeBodies(Stream& stream, FrameEntry& entry);

  RecordingWriter writer_;
  replication::Quantizer quantizer_;
  replication::DenseCodec codec_;
  std::optional<TimePoint> begin_;
  TimePoint newest_{};
  bool failed_ = false;
  std::deque<Waiting> waiting_;  // ascending by time
  std::map<RegionId, Stream> streams_;

  // As of what is written.
  bool started_;
  std::string map_;                     // WrittenMap
  replication::Bytes world_;            // properties; empty: as the scene gives them
  std::map<RegionId, bool> connected_;  // regions that have begun
  std::chrono::microseconds last_key_{};
  std::uint64_t last_key_end_ = 0, last_key_bytes_ = 0;
};

}  // namespace tessera::client
