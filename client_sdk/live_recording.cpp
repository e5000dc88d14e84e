#include "client_sdk/live_recording.h"

#include <algorithm>
#include <map>

namespace tessera::client {
namespace {

// Whether the event is not recorded: the view makes it again when it is played back, it is not about bodies, or it is
// about one that only this client has shown, or from this client alone.
bool FollowsFromTheWorld(ClientEvent::Kind kind) {
  using Kind = ClientEvent::Kind;
  return kind == Kind::kAppeared || kind == Kind::kVanished || kind == Kind::kPropertyChanged || kind == Kind::kEnded ||
         kind == Kind::kRecordingEnded || kind == Kind::kWorldPropertyChanged || kind == Kind::kSpawnTaken ||
         kind == Kind::kSpawnLost || kind == Kind::kTileCame || kind == Kind::kTileGone;
}

}  // namespace

absl::Status LiveRecording::Begin(const std::string& file, const RecordingHeader& header, const Scene& scene,
                                  std::uint64_t max_bytes) {
  absl::StatusOr<RecordingWriter> writer = RecordingWriter::Create(file, header, max_bytes);
  if (!writer.ok()) return writer.status();
  recorder_.emplace(*std::move(writer), scene, header);
  return absl::OkStatus();
}

void LiveRecording::AddKnown(TimePoint now, const WorldView& world, const PropertySet& properties,
                             std::span<const RegionId> welcomed) {
  if (!recorder_) return;
  if (!properties.empty()) recorder_->World(now, properties.Encode());
  std::map<RegionId, replication::ReceivedSnapshot> known;
  for (const auto& [id, body] : world.bodies()) {
    replication::ReceivedSnapshot& snapshot = known[body.region];
    snapshot.tick = std::max(snapshot.tick, body.tick);
    snapshot.bodies.push_back({id, body.epoch, body.state, body.properties});
  }
  for (const RegionId region : welcomed) known.try_emplace(region);
  for (const auto& [region, snapshot] : known) {
    recorder_->Region(now, region, RegionEntry::Change::kBegins);
    if (!snapshot.bodies.empty()) recorder_->Snapshot(now, region, snapshot);
    const bool connected = std::ranges::binary_search(welcomed, region);
    if (!connected) recorder_->Region(now, region, RegionEntry::Change::kLost);
  }
}

void LiveRecording::Snapshot(TimePoint now, RegionId region, const replication::ReceivedSnapshot& snapshot) {
  if (recorder_) recorder_->Snapshot(now, region, snapshot);
}

void LiveRecording::Region(TimePoint now, RegionId region, RegionEntry::Change change) {
  if (recorder_) recorder_->Region(now, region, change);
}

void LiveRecording::Map(TimePoint now, const PartitionMap& map) {
  if (recorder_) recorder_->Map(now, WrittenMap(map));
}

void LiveRecording::World(TimePoint now, const replication::Bytes& properties) {
  if (recorder_) recorder_->World(now, properties);
}

void LiveRecording::Note(TimePoint now, std::string text) {
  if (recorder_) recorder_->Note(now, std::move(text));
}

void LiveRecording::EndPoll(TimePoint now, bool ended, std::vector<ClientEvent>& events) {
  if (!recorder_) return;
  for (const ClientEvent& event : events) {
    if (!FollowsFromTheWorld(event.kind)) recorder_->Event(now, event);
  }
  absl::Status status = recorder_->Flush(now);
  if (status.ok() && !ended) return;
  const absl::Status closed = End();
  if (status.ok()) status = closed;
  if (status.ok()) return;
  events.push_back({.kind = ClientEvent::Kind::kRecordingEnded, .detail = std::string(status.message())});
}

absl::Status LiveRecording::End() {
  if (!recorder_) return absl::OkStatus();
  const absl::Status status = recorder_->Close();
  recorder_.reset();
  return status;
}

}  // namespace tessera::client
