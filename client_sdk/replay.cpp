#include "client_sdk/replay.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/world/byte_view.h"
#include "core/world/limits.h"
#include "core/world/packed_scene.h"

namespace tessera::client {
namespace {

using replication::DenseBody;

// The moment that ends a recording is still shown.
constexpr std::chrono::milliseconds kLastFrame{1};

absl::Status Named(const std::string& name, absl::string_view what) {
  return absl::DataLossError(absl::StrCat(name, ": ", what));
}

}  // namespace

absl::StatusOr<Replay> Replay::Open(const std::string& file) {
  absl::StatusOr<RecordingReader> reader = RecordingReader::Open(file);
  if (!reader.ok()) return reader.status();
  return Open(*std::move(reader), file);
}

absl::StatusOr<Replay> Replay::Open(RecordingReader reader, const std::string& name) {
  const RecordingHeader& header = reader.header();
  absl::StatusOr<std::shared_ptr<const Scene>> scene = UnpackScene(AsBytes(header.scene));
  if (!scene.ok()) return Named(name, scene.status().message());
  absl::StatusOr<PartitionMap> map = MapFromWritten(header.map);
  if (!map.ok()) return Named(name, absl::StrCat("map: ", map.status().message()));
  Session session;
  session.player = header.player;
  session.map = *std::move(map);
  session.scene = *std::move(scene);
  session.tick_rate_hz = header.tick_rate_hz;
  session.snapshot_rate_hz = header.snapshot_rate_hz;
  return Replay(std::move(reader), name, std::move(session));
}

Replay::Replay(RecordingReader reader, std::string name, Session session)
    : reader_(std::move(reader)),
      name_(std::move(name)),
      session_(std::move(session)),
      quantizer_(session_.scene->bounds, replication::SnapshotSettingsFor(*session_.scene)),
      codec_(replication::MakeDenseCodec(session_.scene->bounds, replication::SnapshotSettingsFor(*session_.scene),
                                         session_.scene->gravity_m_s2.y)) {}

absl::StatusOr<std::optional<Replay::Step>> Replay::Next(TimePoint now) {
  if (!begin_) begin_ = now - from_;
  while (!ended_) {
    if (!next_) {
      absl::StatusOr<std::optional<RecordedEntry>> read = reader_.Next();
      if (!read.ok()) return read.status();
      next_ = *std::move(read);
      if (!next_) {
        ended_ = now - *begin_ > reader_.length() + kLastFrame;
        break;
      }
    }
    if (now - *begin_ < next_->at) break;
    absl::StatusOr<std::optional<Step>> step = StepOf(*std::exchange(next_, std::nullopt));
    if (!step.ok()) return Named(name_, step.status().message());
    if (step->has_value()) return step;
  }
  return std::optional<Step>();
}

void Replay::Seek(std::chrono::microseconds at) {
  from_ = std::clamp(at, std::chrono::microseconds(0), reader_.length());
  reader_.Seek(from_);
  begin_.reset();
  next_.reset();
  ended_ = false;
  knows_nothing_ = true;
  frames_.clear();
}

// Nothing for a key that is met on the way.
absl::StatusOr<std::optional<Replay::Step>> Replay::StepOf(RecordedEntry entry) {
  const TimePoint at = *begin_ + entry.at;
  if (const auto* key = std::get_if<KeyEntry>(&entry.what)) {
    if (!knows_nothing_) return std::optional<Step>();
    absl::StatusOr<PartitionMap> map = MapFromWritten(key->map);
    if (!map.ok()) return absl::DataLossError(absl::StrCat("key: map: ", map.status().message()));
    absl::StatusOr<PropertySet> world = PropertySet::Decode(key->world, session_.scene->instance_properties);
    if (!world.ok()) return absl::DataLossError(absl::StrCat("key: world: ", world.status().message()));
    return Step{at, Standing{key->started, *std::move(map), key->regions, *std::move(world)}};
  }
  if (const auto* key = std::get_if<KeyFrameEntry>(&entry.what)) {
    frames_.erase(key->frame.region);
    absl::StatusOr<Snapshot> snapshot = Decode(key->frame);
    if (!snapshot.ok()) return snapshot.status();
    if (!knows_nothing_) return std::optional<Step>();
    return Step{at, *std::move(snapshot)};
  }
  knows_nothing_ = false;
  if (auto* note = std::get_if<NoteEntry>(&entry.what)) return Step{at, std::move(*note)};
  if (const auto* frame = std::get_if<FrameEntry>(&entry.what)) {
    absl::StatusOr<Snapshot> snapshot = Decode(*frame);
    if (!snapshot.ok()) return snapshot.status();
    return Step{at, *std::move(snapshot)};
  }
  if (const auto* change = std::get_if<RegionEntry>(&entry.what)) {
    if (BeginsAnew(change->change)) frames_.erase(change->region);
    return Step{at, *change};
  }
  if (const auto* written = std::get_if<MapEntry>(&entry.what)) {
    absl::StatusOr<PartitionMap> map = MapFromWritten(written->map);
    if (!map.ok()) return absl::DataLossError(absl::StrCat("map: ", map.status().message()));
    return Step{at, *std::move(map)};
  }
  if (const auto* world = std::get_if<WorldEntry>(&entry.what)) {
    absl::StatusOr<PropertySet> changed = PropertySet::Decode(world->properties, session_.scene->instance_properties);
    if (!changed.ok()) return absl::DataLossError(absl::StrCat("world: ", changed.status().message()));
    return Step{at, World{*std::move(changed)}};
  }
  return Step{at, std::get<ClientEvent>(std::move(entry.what))};
}

// The snapshot as the region sent it: only bodies that are new or differ from the frame before.
absl::StatusOr<Replay::Snapshot> Replay::Decode(const FrameEntry& entry) {
  if (frames_.size() >= kMaxRegions && !frames_.contains(entry.region)) return absl::DataLossError("too many regions");
  replication::DenseCodec::References& known = frames_[entry.region];
  auto kept = codec_.Decode(entry.frame, [&](Tick tick) -> replication::DenseCodec::KeptPtr {
    for (const auto& frame : {known.base, known.older, known.oldest}) {
      if (frame != nullptr && frame->frame.tick == tick) return frame;
    }
    return nullptr;
  });
  if (!kept.ok()) return kept.status();
  const replication::DenseFrame& frame = (*kept)->frame;
  if (known.base != nullptr && frame.tick <= known.base->frame.tick)
    return absl::DataLossError("frame: tick goes back");
  Snapshot snapshot{entry.region, {}};
  snapshot.received.tick = frame.tick;
  snapshot.received.last_input = entry.last_input;
  snapshot.received.departures = entry.departures;
  const std::vector<DenseBody> none;
  const auto& before = known.base != nullptr ? known.base->frame.bodies : none;
  auto old = before.begin();
  auto properties = entry.properties.begin();
  auto jumps = entry.jumps.begin();
  for (const DenseBody& body : frame.bodies) {
    while (old != before.end() && old->id < body.id) ++old;
    while (properties != entry.properties.end() && properties->first < body.id) ++properties;
    while (jumps != entry.jumps.end() && jumps->first < body.id) ++jumps;
    const bool same = old != before.end() && *old == body;
    const bool has_properties = properties != entry.properties.end() && properties->first == body.id;
    if (same && !has_properties) continue;
    if (old == before.end() || old->id != body.id) ++snapshot.received.full_records;
    snapshot.received.bodies.push_back(
        {body.id, body.epoch, quantizer_.Dequantize(body.state), has_properties ? properties->second : nullptr});
    if (jumps != entry.jumps.end() && jumps->first == body.id)
      snapshot.received.bodies.back().traits.jumps = jumps->second;
  }
  known = {.base = *std::move(kept), .older = std::move(known.base), .oldest = std::move(known.older)};
  return snapshot;
}

}  // namespace tessera::client
