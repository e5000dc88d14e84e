// A client that records, and one that is a recording.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "client_sdk/client_impl.h"
#include "client_sdk/recording_format.h"
#include "core/world/byte_view.h"
#include "core/world/packed_scene.h"

namespace tessera::client {
namespace {

constexpr std::size_t kMaxNotes = 256;  // that nobody has taken

// Whether the event is not recorded: the view makes it again when it is played back, it is not about bodies, or about
// one that only this client has shown.
// Or from this client alone.
bool FollowsFromTheWorld(ClientEvent::Kind kind) {
  using Kind = ClientEvent::Kind;
  return kind == Kind::kAppeared || kind == Kind::kVanished || kind == Kind::kPropertyChanged || kind == Kind::kEnded ||
         kind == Kind::kRecordingEnded || kind == Kind::kWorldPropertyChanged || kind == Kind::kSpawnTaken ||
         kind == Kind::kSpawnLost || kind == Kind::kTileCame || kind == Kind::kTileGone;
}

// The value is asked for after all events, so those before the last one would say the same.
void KeepLastOfEachWorldProperty(std::vector<ClientEvent>& events) {
  std::set<std::string> later;
  for (std::size_t i = events.size(); i-- > 0;) {
    if (events[i].kind != ClientEvent::Kind::kWorldPropertyChanged || later.insert(events[i].property).second) continue;
    events.erase(events.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

}  // namespace

void Client::Impl::RegionChanged(TimePoint now, RegionId region, RegionEntry::Change change) {
  if (recorder) recorder->Region(now, region, change);
  switch (change) {
    case RegionEntry::Change::kBegins:
      return world.RegionBegins(now, region);
    case RegionEntry::Change::kLost:
      return world.RegionLost(region);
    case RegionEntry::Change::kGone:
      return world.RegionGone(now, region);
    case RegionEntry::Change::kOutOfSight:
      return world.RegionOutOfSight(region, events);
  }
}

absl::Status Client::Record(const std::string& file, std::uint64_t max_bytes) {
  Impl& me = *impl_;
  if (me.recorder) return absl::FailedPreconditionError("a recording is under way");
  if (me.replay) return absl::FailedPreconditionError("this is a recording itself");
  if (me.progress.ended()) return absl::FailedPreconditionError("the client has ended");
  if (me.delivery.under_way()) return absl::FailedPreconditionError("the scene is not here yet");
  const std::vector<std::uint8_t> scene = PackScene(*me.session.scene);
  const RecordingHeader header{.instance_id = me.settings.instance_id,
                               .player = me.own.player(),
                               .tick_rate_hz = me.session.tick_rate_hz,
                               .snapshot_rate_hz = me.session.snapshot_rate_hz,
                               .started = me.progress.started(),
                               .map = WrittenMap(me.regions.map()),
                               .scene = std::string(AsText(scene))};
  absl::StatusOr<RecordingWriter> writer = RecordingWriter::Create(file, header, max_bytes);
  if (!writer.ok()) return writer.status();
  me.recorder.emplace(*std::move(writer), *me.session.scene, header);
  if (me.last_poll) me.RecordAllKnown(*me.last_poll);
  return absl::OkStatus();
}

absl::Status Client::StopRecording() { return impl_->EndRecording(); }
bool Client::recording() const { return impl_->recorder.has_value(); }
std::uint64_t Client::recorded_bytes() const { return impl_->recorder ? impl_->recorder->bytes() : 0; }

absl::Status Client::Note(std::string text) {
  if (text.size() > kMaxNoteBytes) {
    return absl::InvalidArgumentError(absl::StrCat("text: has ", text.size(), " bytes; at most ", kMaxNoteBytes));
  }
  if (impl_->recorder && impl_->last_poll) impl_->recorder->Note(*impl_->last_poll, std::move(text));
  return absl::OkStatus();
}

std::vector<std::string> Client::TakeNotes() { return std::exchange(impl_->notes, {}); }

// Records the known world as if the regions had just begun to send, in the order of their ids.
void Client::Impl::RecordAllKnown(TimePoint now) {
  if (!properties.changed().empty()) recorder->World(now, properties.changed().Encode());
  std::map<RegionId, replication::ReceivedSnapshot> known;
  for (const auto& [id, body] : world.bodies()) {
    replication::ReceivedSnapshot& snapshot = known[body.region];
    snapshot.tick = std::max(snapshot.tick, body.tick);
    snapshot.bodies.push_back({id, body.epoch, body.state, body.properties});
  }
  for (const RegionId region : regions.Welcomed()) known.try_emplace(region);
  for (const auto& [region, snapshot] : known) {
    recorder->Region(now, region, RegionEntry::Change::kBegins);
    if (!snapshot.bodies.empty()) recorder->Snapshot(now, region, snapshot);
    if (!regions.IsWelcomed(region)) recorder->Region(now, region, RegionEntry::Change::kLost);
  }
}

void Client::Impl::RecordEvents(TimePoint now) {
  if (!recorder) return;
  for (const ClientEvent& event : events) {
    if (!FollowsFromTheWorld(event.kind)) recorder->Event(now, event);
  }
  absl::Status status = recorder->Flush(now);
  if (status.ok() && !progress.ended()) return;
  const absl::Status closed = EndRecording();
  if (status.ok()) status = closed;
  if (status.ok()) return;
  events.push_back({.kind = ClientEvent::Kind::kRecordingEnded, .detail = std::string(status.message())});
}

absl::Status Client::Impl::EndRecording() {
  if (!recorder) return absl::OkStatus();
  const absl::Status status = recorder->Close();
  recorder.reset();
  return status;
}

absl::StatusOr<std::unique_ptr<Client>> Client::Play(const std::string& file) {
  absl::StatusOr<Replay> replay = Replay::Open(file);
  if (!replay.ok()) return replay.status();
  return std::unique_ptr<Client>(new Client(Impl::Playing(*std::move(replay))));
}

std::unique_ptr<Client::Impl> Client::Impl::Playing(Replay from) {
  auto impl = std::make_unique<Impl>(Settings{.instance_id = from.header().instance_id}, from.session(), nullptr);
  impl->progress.Stand(from.header().started);
  impl->replay.emplace(std::move(from));
  return impl;
}

absl::Status Client::Seek(std::chrono::microseconds at) {
  if (!impl_->replay) return absl::FailedPreconditionError("only a recording can be sought in");
  Replay replay = *std::move(impl_->replay);
  replay.Seek(at);
  std::unique_ptr<Impl> sought = Impl::Playing(std::move(replay));
  sought->catching_up = true;
  for (const auto& [id, body] : impl_->world.bodies()) {
    sought->events.push_back({.kind = ClientEvent::Kind::kVanished, .body = id, .region = body.region});
  }
  // It begins with the scene's own values; those that stood there come by events of their own.
  for (const std::string_view name :
       ChangedProperties(impl_->session.scene->instance_properties, impl_->properties.changed(), PropertySet())) {
    sought->events.push_back({.kind = ClientEvent::Kind::kWorldPropertyChanged, .property = std::string(name)});
  }
  impl_ = std::move(sought);
  return absl::OkStatus();
}

std::optional<std::chrono::microseconds> Client::length() const {
  return impl_->replay ? std::optional(impl_->replay->length()) : std::nullopt;
}

void Client::Impl::PlayBack(TimePoint now) {
  for (;;) {
    absl::StatusOr<std::optional<Replay::Step>> step = replay->Next(now);
    if (!step.ok()) return End(step.status(), "");
    if (!step->has_value()) break;
    const TimePoint at = (*step)->at;
    PlayStep(**std::move(step));
    // As the frames would have been drawn, so that the moment that is shown is right at once.
    if (catching_up) time.Advance(at);
  }
  if (catching_up) KeepLastOfEachWorldProperty(events);
  catching_up = false;
  world.Expire(now, events);
  if (replay->ended()) End(absl::OkStatus(), "the recording ends");
}

// Plays an entry at its own time, however rarely Poll is called.
void Client::Impl::PlayStep(Replay::Step step) {
  world.Expire(step.at, events);
  if (auto* snapshot = std::get_if<Replay::Snapshot>(&step.what)) {
    inputs.NoteLast(snapshot->received.last_input);
    figures.TookRecords(snapshot->received.full_records,
                        snapshot->received.bodies.size() - snapshot->received.full_records);
    time.Arrived(step.at, snapshot->received.tick);
    world.Take(step.at, snapshot->region, snapshot->received, events);
  } else if (const auto* change = std::get_if<RegionEntry>(&step.what)) {
    RegionChanged(step.at, change->region, change->change);
  } else if (auto* map = std::get_if<PartitionMap>(&step.what)) {
    regions.SetMap(std::move(*map));
  } else if (auto* standing = std::get_if<Replay::Standing>(&step.what)) {
    regions.SetMap(std::move(standing->map));
    progress.Stand(standing->started);
    properties.Change(std::move(standing->world), session.scene->instance_properties, events);
    for (const auto& [region, connected] : standing->regions) {
      RegionChanged(step.at, region, RegionEntry::Change::kBegins);
      if (!connected) RegionChanged(step.at, region, RegionEntry::Change::kLost);
    }
  } else if (auto* note = std::get_if<NoteEntry>(&step.what)) {
    if (notes.size() == kMaxNotes) notes.erase(notes.begin());
    notes.push_back(std::move(note->text));
  } else if (auto* of_world = std::get_if<Replay::World>(&step.what)) {
    properties.Change(std::move(of_world->changed), session.scene->instance_properties, events);
  } else {
    auto& event = std::get<ClientEvent>(step.what);
    if (event.kind == ClientEvent::Kind::kStarted) progress.Stand(true);
    events.push_back(std::move(event));
  }
}

}  // namespace tessera::client
