// LiveRecording: the recording that a client makes of the world that it sees, while it makes one. Between recordings
// everything that it is given is passed over.
//
//   recording.Begin(file, header, scene, max_bytes);  recording.AddKnown(now, world, properties, welcomed);
//   recording.Snapshot(now, region, snapshot);  ...      // as regions send them
//   recording.EndPoll(now, ended, events);               // once a poll, after its events
//
// Promise: a recording that cannot go on is ended, and an event says why. What plays it back makes the events anew that
// follow from the world, so they are not in it.
// Thread rule: one thread at a time; time comes in. Touches the file.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client_sdk/recorder.h"
#include "client_sdk/world_view.h"

namespace tessera::client {

class LiveRecording {
 public:
  // Requires that none is under way. Errors: those of RecordingWriter::Create.
  absl::Status Begin(const std::string& file, const RecordingHeader& header, const Scene& scene,
                     std::uint64_t max_bytes);
  bool under_way() const { return recorder_.has_value(); }
  std::uint64_t bytes() const { return recorder_ ? recorder_->bytes() : 0; }
  // The known world as if its regions had just begun to send, in the order of their ids. `properties`: of the world,
  // that differ from the scene's. `welcomed`: the regions that are connected, ascending.
  void AddKnown(TimePoint now, const WorldView& world, const PropertySet& properties,
                std::span<const RegionId> welcomed);

  // As Recorder.
  void Snapshot(TimePoint now, RegionId region, const replication::ReceivedSnapshot& snapshot);
  void Region(TimePoint now, RegionId region, RegionEntry::Change change);
  void Map(TimePoint now, const PartitionMap& map);
  void World(TimePoint now, const replication::Bytes& properties);
  void Note(TimePoint now, std::string text);

  // Writes the events of the poll, and what need not wait any more. `ended`: the client has.
  void EndPoll(TimePoint now, bool ended, std::vector<ClientEvent>& events);
  // Makes the file whole. OK if there is none.
  absl::Status End();

 private:
  std::optional<Recorder> recorder_;
};

}  // namespace tessera::client
