// A client that records, and one that is a recording.
#include "absl/strings/str_cat.h"
#include "client_sdk/client_impl.h"
#include "client_sdk/recording_format.h"
#include "core/world/byte_view.h"
#include "core/world/packed_scene.h"

namespace tessera::client {

void Client::Impl::RegionChanged(TimePoint now, RegionId region, RegionEntry::Change change) {
  recording.Region(now, region, change);
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
  if (me.recording.under_way()) return absl::FailedPreconditionError("a recording is under way");
  if (me.playback) return absl::FailedPreconditionError("this is a recording itself");
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
  const absl::Status begun = me.recording.Begin(file, header, *me.session.scene, max_bytes);
  if (begun.ok() && me.last_poll) {
    me.recording.AddKnown(*me.last_poll, me.world, me.properties.changed(), me.regions.Welcomed());
  }
  return begun;
}

absl::Status Client::StopRecording() { return impl_->recording.End(); }
bool Client::recording() const { return impl_->recording.under_way(); }
std::uint64_t Client::recorded_bytes() const { return impl_->recording.bytes(); }

absl::Status Client::Note(std::string text) {
  if (text.size() > kMaxNoteBytes) {
    return absl::InvalidArgumentError(absl::StrCat("text: has ", text.size(), " bytes; at most ", kMaxNoteBytes));
  }
  if (impl_->last_poll) impl_->recording.Note(*impl_->last_poll, std::move(text));
  return absl::OkStatus();
}

std::vector<std::string> Client::TakeNotes() {
  return impl_->playback ? impl_->playback->TakeNotes() : std::vector<std::string>();
}

absl::StatusOr<std::unique_ptr<Client>> Client::Play(const std::string& file) {
  absl::StatusOr<Replay> replay = Replay::Open(file);
  if (!replay.ok()) return replay.status();
  return std::unique_ptr<Client>(new Client(Impl::Playing(Playback(*std::move(replay)))));
}

std::unique_ptr<Client::Impl> Client::Impl::Playing(Playback from) {
  auto impl = std::make_unique<Impl>(Settings{.instance_id = from.header().instance_id}, from.session(), nullptr);
  impl->progress.Stand(from.header().started);
  impl->playback.emplace(std::move(from));
  return impl;
}

absl::Status Client::Seek(std::chrono::microseconds at) {
  if (!impl_->playback) return absl::FailedPreconditionError("only a recording can be sought in");
  std::unique_ptr<Impl> sought = Impl::Playing(Playback(*std::move(impl_->playback), at));
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
  return impl_->playback ? std::optional(impl_->playback->length()) : std::nullopt;
}

void Client::Impl::PlayBack(TimePoint now) {
  for (;;) {
    absl::StatusOr<std::optional<Replay::Step>> step = playback->Next(now);
    if (!step.ok()) return End(step.status(), "");
    if (!step->has_value()) break;
    const TimePoint at = (*step)->at;
    PlayStep(**std::move(step));
    // As the frames would have been drawn, so that the moment that is shown is right at once.
    if (playback->catching_up()) time.Advance(at);
  }
  playback->EndPoll(events);
  world.Expire(now, events);
  if (playback->ended()) End(absl::OkStatus(), "the recording ends");
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
    playback->AddNote(std::move(note->text));
  } else if (auto* of_world = std::get_if<Replay::World>(&step.what)) {
    properties.Change(std::move(of_world->changed), session.scene->instance_properties, events);
  } else {
    auto& event = std::get<ClientEvent>(step.what);
    if (event.kind == ClientEvent::Kind::kStarted) progress.Stand(true);
    events.push_back(std::move(event));
  }
}

}  // namespace tessera::client
