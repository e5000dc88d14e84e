// Recorder: what a client is told, gathered into frames and written.
//
// Of each region, each tick that it told of becomes one frame, coded by the dense coder against the region's frames
// before it; what a datagram brings late is put where it belongs for kHold, then into the next frame, so that nothing
// that was told is missing in the end.
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

  // It begins with the first that it is told.
  Recorder(RecordingWriter writer, const Scene& scene);

  void Snapshot(TimePoint now, RegionId region, const replication::ReceivedSnapshot& snapshot);
  void Region(TimePoint now, RegionId region, RegionEntry::Change change);
  void Map(TimePoint now, std::string map);
  void Event(TimePoint now, const ClientEvent& event);

  // Writes what need not wait any more. Errors: those of RecordingWriter::Write; nothing more is written then.
  absl::Status Flush(TimePoint now);
  // Writes all, and what makes the file whole; the recorder is at its end.
  absl::Status Close();

 private:
  struct Told {
    Tick tick;
    Epoch epoch;
    replication::QuantizedState state;
  };
  struct Gone {
    Tick tick;
    Epoch epoch;
  };
  // What was told of a region, up to what is written.
  struct Stream {
    std::map<BodyId, Told> bodies;
    std::map<BodyId, Gone> gone;
    Tick written;
    replication::DenseCodec::References frames{};  // the last three
  };
  struct OpenFrame {
    RegionId region;
    Tick tick;
    std::uint32_t last_input = 0;
    std::map<BodyId, Told> bodies;
    std::map<BodyId, std::pair<Tick, std::shared_ptr<const replication::Bytes>>> properties;
    std::vector<replication::DepartureRecord> departures;
  };
  struct Waiting {
    TimePoint at;
    std::variant<OpenFrame, RegionEntry, MapEntry, ClientEvent> what;
  };

  void Wait(Waiting waiting);
  std::chrono::microseconds Since(TimePoint at) const;  // the beginning
  OpenFrame& FrameOf(TimePoint now, RegionId region, Tick tick);
  absl::Status WriteWaiting(std::optional<TimePoint> now);  // nothing: all of it
  absl::Status Write(Waiting waiting);
  static void Bring(Stream& stream, OpenFrame& frame);  // up to date
  FrameEntry Encode(OpenFrame frame);

  RecordingWriter writer_;
  replication::Quantizer quantizer_;
  replication::DenseCodec codec_;
  std::optional<TimePoint> begin_;
  TimePoint newest_{};
  bool failed_ = false;
  std::deque<Waiting> waiting_;  // ascending by time
  std::map<RegionId, Stream> streams_;
};

}  // namespace tessera::client
