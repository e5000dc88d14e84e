#include "client_sdk/recorder.h"

#include <algorithm>

namespace tessera::client {

using replication::DepartureRecord;

Recorder::Recorder(RecordingWriter writer, const Scene& scene, const RecordingHeader& header)
    : writer_(std::move(writer)),
      quantizer_(scene.bounds, replication::SnapshotSettingsFor(scene)),
      codec_(replication::MakeDenseCodec(scene.bounds, replication::SnapshotSettingsFor(scene), scene.gravity_m_s2.y)),
      started_(header.started),
      map_(header.map) {}

// Frames of a region wait in the order of their ticks, in whatever order their datagrams come.
Recorder::OpenFrame& Recorder::FrameOf(TimePoint now, RegionId region, Tick tick) {
  auto before = waiting_.end();  // the oldest one that is younger
  for (auto at = waiting_.end(); at != waiting_.begin();) {
    --at;
    if (const auto* change = std::get_if<RegionEntry>(&at->what); change != nullptr && change->region == region) break;
    auto* frame = std::get_if<OpenFrame>(&at->what);
    if (frame == nullptr || frame->region != region) continue;
    if (frame->tick == tick) return *frame;
    if (frame->tick < tick) break;
    before = at;
  }
  if (!begin_) begin_ = now;
  newest_ = std::max(newest_, now);
  const TimePoint time = before == waiting_.end() ? now : before->at;
  OpenFrame fresh;
  fresh.region = region;
  fresh.tick = tick;
  return std::get<OpenFrame>(waiting_.insert(before, {time, std::move(fresh)})->what);
}

void Recorder::Snapshot(TimePoint now, RegionId region, const replication::ReceivedSnapshot& snapshot) {
  OpenFrame& frame = FrameOf(now, region, snapshot.tick);
  frame.last_input = std::max(frame.last_input, snapshot.last_input);
  for (const replication::BodyRecord& body : snapshot.bodies) {
    const RecordedBody recorded{snapshot.tick, body.epoch, quantizer_.Quantize(body.state), body.traits.jumps};
    const auto [at, fresh] = frame.bodies.try_emplace(body.id, recorded);
    if (!fresh && recorded.epoch > at->second.epoch) at->second = recorded;
    if (body.properties != nullptr) frame.properties[body.id] = {snapshot.tick, body.properties};
  }
  frame.departures.insert(frame.departures.end(), snapshot.departures.begin(), snapshot.departures.end());
}

void Recorder::Region(TimePoint now, RegionId region, RegionEntry::Change change) {
  Wait({now, RegionEntry{region, change}});
}
void Recorder::Map(TimePoint now, std::string map) { Wait({now, MapEntry{std::move(map)}}); }
void Recorder::Event(TimePoint now, const ClientEvent& event) { Wait({now, event}); }
void Recorder::Note(TimePoint now, std::string text) { Wait({now, NoteEntry{std::move(text)}}); }
void Recorder::World(TimePoint now, replication::Bytes properties) { Wait({now, WorldEntry{std::move(properties)}}); }

std::chrono::microseconds Recorder::Since(TimePoint at) const {
  if (!begin_) return {};
  return std::max(std::chrono::duration_cast<std::chrono::microseconds>(at - *begin_), std::chrono::microseconds(0));
}

void Recorder::Wait(Waiting waiting) {
  if (!begin_) begin_ = waiting.at;
  newest_ = std::max(newest_, waiting.at);
  waiting_.push_back(std::move(waiting));
}

absl::Status Recorder::Flush(TimePoint now) {
  if (!begin_) begin_ = now;
  newest_ = now;
  return WriteWaiting(now);
}

// An entry that is left out would leave those after it without what they refer to, so the first fault is the end.
absl::Status Recorder::WriteWaiting(std::optional<TimePoint> now) {
  while (!waiting_.empty() && !failed_) {
    const bool open = std::holds_alternative<OpenFrame>(waiting_.front().what);
    if (open && now && *now - waiting_.front().at < kHold) break;
    Waiting due = std::move(waiting_.front());
    waiting_.pop_front();
    if (absl::Status status = Write(std::move(due)); !status.ok()) {
      failed_ = true;
      return status;
    }
  }
  return absl::OkStatus();
}

absl::Status Recorder::Close() {
  absl::Status status = WriteWaiting(std::nullopt);
  // The written part of the file stays readable, whatever the error was.
  const absl::Status closed = writer_.Close(Since(newest_));
  return status.ok() ? closed : status;
}

absl::Status Recorder::Write(Waiting waiting) {
  RecordedEntry entry{Since(waiting.at), RegionEntry()};
  if (absl::Status status = WriteKeyIfDue(entry.at); !status.ok()) return status;
  if (auto* frame = std::get_if<OpenFrame>(&waiting.what)) {
    entry.what = Encode(std::move(*frame));
  } else if (auto* change = std::get_if<RegionEntry>(&waiting.what)) {
    using Change = RegionEntry::Change;
    if (BeginsAnew(change->change)) streams_.erase(change->region);
    if (change->change == Change::kBegins || change->change == Change::kLost) {
      connected_[change->region] = change->change == Change::kBegins;
    } else {
      connected_.erase(change->region);
    }
    entry.what = *change;
  } else if (auto* map = std::get_if<MapEntry>(&waiting.what)) {
    map_ = map->map;
    entry.what = std::move(*map);
  } else if (auto* note = std::get_if<NoteEntry>(&waiting.what)) {
    entry.what = std::move(*note);
  } else if (auto* world = std::get_if<WorldEntry>(&waiting.what)) {
    world_ = world->properties;
    entry.what = std::move(*world);
  } else {
    auto& event = std::get<ClientEvent>(waiting.what);
    started_ = started_ || event.kind == ClientEvent::Kind::kStarted;
    entry.what = std::move(event);
  }
  return writer_.Write(entry);
}

absl::Status Recorder::WriteKeyIfDue(std::chrono::microseconds at) {
  const std::uint64_t begin = writer_.bytes();
  if (at - last_key_ < kKeyInterval || begin - last_key_end_ < last_key_bytes_) return absl::OkStatus();
  last_key_ = at;
  KeyEntry key{.started = started_, .map = map_, .regions = {connected_.begin(), connected_.end()}};
  key.frames = static_cast<std::uint32_t>(streams_.size());
  key.world = world_;
  absl::Status status = writer_.Write({at, std::move(key)});
  for (auto& [region, stream] : streams_) {
    FrameEntry frame{.region = region, .last_input = stream.last_input};
    frame.properties.assign(stream.properties.begin(), stream.properties.end());
    stream.frames = {};
    EncodeBodies(stream, frame);
    if (status.ok()) status = writer_.Write({at, KeyFrameEntry{std::move(frame)}});
  }
  last_key_end_ = writer_.bytes();
  last_key_bytes_ = last_key_end_ - begin;
  return status;
}

void Recorder::Merge(Stream& stream, OpenFrame& frame) {
  const auto older = [](const auto& a, const auto& b) {
    return a.epoch < b.epoch || (a.epoch == b.epoch && a.tick < b.tick);
  };
  for (const DepartureRecord& departure : frame.departures) {
    const Departed gone{frame.tick, departure.epoch};
    const auto [at, fresh] = stream.gone.try_emplace(departure.id, gone);
    if (!fresh && older(at->second, gone)) at->second = gone;
    const auto body = stream.bodies.find(departure.id);
    if (body == stream.bodies.end() || older(gone, body->second)) continue;
    stream.bodies.erase(body);
    stream.properties.erase(departure.id);
  }
  for (const auto& [id, body] : frame.bodies) {
    if (const auto gone = stream.gone.find(id); gone != stream.gone.end()) {
      if (older(body, gone->second)) continue;
      stream.gone.erase(gone);
    }
    const auto [at, fresh] = stream.bodies.try_emplace(id, body);
    if (!fresh && !older(body, at->second)) at->second = body;
  }
  // A body that left and came back within a tick has not been away.
  std::erase_if(frame.departures, [&](const DepartureRecord& d) { return stream.bodies.contains(d.id); });
}

FrameEntry Recorder::Encode(OpenFrame frame) {
  Stream& stream = streams_[frame.region];
  Merge(stream, frame);
  FrameEntry entry{.region = frame.region, .last_input = frame.last_input};
  entry.departures = std::move(frame.departures);
  for (auto& [id, property] : frame.properties) {
    if (!stream.bodies.contains(id)) continue;
    stream.properties[id] = property.second;
    entry.properties.emplace_back(id, std::move(property.second));
  }
  stream.last_input = std::max(stream.last_input, frame.last_input);
  // A frame that comes after a later one takes that one's next tick: newer states stay.
  stream.written = std::max(frame.tick, stream.written + 1);
  EncodeBodies(stream, entry);
  return entry;
}

// All bodies of the region as of its newest tick, against its frames before.
void Recorder::EncodeBodies(Stream& stream, FrameEntry& entry) {
  replication::DenseFrame dense{.tick = stream.written, .bodies = {}, .departures = {}};
  dense.bodies.reserve(stream.bodies.size());
  for (const auto& [id, body] : stream.bodies) {
    dense.bodies.push_back({id, body.epoch, body.state});
    if (body.jumps != 0) entry.jumps.emplace_back(id, body.jumps);
  }
  auto encoded = codec_.Encode(std::move(dense), stream.frames);
  entry.frame = std::move(encoded.bytes);
  stream.frames = {.base = std::move(encoded.kept),
                   .older = std::move(stream.frames.base),
                   .oldest = std::move(stream.frames.older)};
}

}  // namespace tessera::client
