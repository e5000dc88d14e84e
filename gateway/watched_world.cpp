#include "gateway/watched_world.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gateway/gateway_message.h"
#include "gateway/viewer_format.h"
#include "spdlog/spdlog.h"

namespace tessera::gateway {
namespace {

using namespace std::chrono_literals;

constexpr auto kStatusInterval = 1s;
constexpr auto kJoinDeadline = 5s;
constexpr auto kJoinAgain = 1s;
// A world without any region for so long is reported; a restore from a checkpoint takes less.
constexpr auto kLostFor = 60s;
// Corrections of all players in a recording. Each takes a hundred bytes, and jumping about shall not fill it.
constexpr int kMaxCorrections_per_s = 20;

bool MayStillCome(const absl::Status& status) {
  return absl::IsDeadlineExceeded(status) || absl::IsUnavailable(status);
}

bool SameEvent(const v1::InstanceEvent& a, const v1::InstanceEvent& b) {
  return a.text() == b.text() && a.time().seconds() == b.time().seconds() && a.time().nanos() == b.time().nanos();
}

}  // namespace

WatchedWorld::WatchedWorld(std::string instance, Services& services)
    : instance_(std::move(instance)), services_(services), feed_(services.channel, instance_, services.wake) {}

void WatchedWorld::Tick(TimePoint now, bool show) {
  if (problem_) return;
  TakeState(now);
  if (problem_) return;
  if (source_ == nullptr) {
    if (!joining_ && now >= next_join_) Join(now);
  } else {
    source_->Poll(now);
    if (source_->over()) {
      spdlog::info("world lost instance={} reason={}", instance_, std::string(source_->WhyOver().message()));
      source_.reset();
      if (recording_wanted_) {
        recording_.on = false;
        recording_.problem = "the world was lost; another recording begins when it is back";
        SayRecording();
      }
      lost_since_ = now;
      next_join_ = now + kJoinAgain;
      status_due_ = true;
    } else if (source_->client().state() != client::ClientState::kJoining) {
      lost_since_.reset();
      if (recording_wanted_) TickRecording();
      if (show) source_->Show(now);
    }
  }
  const bool connected_changed = source_ != nullptr && source_->TakeConnectedChanged();
  if (state_.number != 0 && (status_due_ || connected_changed || now >= next_status_)) MakeStatus(now);
}

void WatchedWorld::Join(TimePoint now) {
  joining_ = true;
  next_join_ = now + kJoinAgain;
  if (!lost_since_) lost_since_ = now;
  const client::JoinOptions options{.control_address = services_.control.address,
                                    .instance_id = instance_,
                                    .player_name = "",
                                    .deadline = kJoinDeadline,
                                    .watch = true,
                                    .credentials = services_.control.credentials};
  const bool queued = services_.background->Run(
      [this, options, alive = std::weak_ptr<bool>(alive_), book = book_, scene = book_scene_]() -> Background::Done {
        auto joined = std::make_shared<absl::StatusOr<std::unique_ptr<client::Client>>>(client::Client::Join(options));
        // Encoding a large level takes a while too.
        std::shared_ptr<const SceneBook> encoded = book;
        if (joined->ok() && &(**joined)->scene() != scene) encoded = std::make_shared<SceneBook>((**joined)->scene());
        return [this, alive, joined, encoded] {
          if (!alive.expired()) Joined(std::move(*joined), encoded);
        };
      });
  if (!queued) joining_ = false;
}

void WatchedWorld::Joined(absl::StatusOr<std::unique_ptr<client::Client>> joined,
                          std::shared_ptr<const SceneBook> book) {
  joining_ = false;
  if (joined.ok()) {
    spdlog::info("world joined instance={}", instance_);
    book_ = std::move(book);
    book_scene_ = &(*joined)->scene();
    source_ = std::make_unique<ViewSource>(*std::move(joined), book_, instance_, ++services_.last_generation);
    source_->SetHosts(Hosts());
    return;
  }
  // An instance that is starting, or starting again, is waited for.
  const bool known = state_.number != 0 && !ProblemOf(state_.instance);
  const bool lost_long = lost_since_ && std::chrono::steady_clock::now() - *lost_since_ > kLostFor;
  if (known && MayStillCome(joined.status()) && !lost_long) return;
  spdlog::info("world not joined instance={} reason={}", instance_, std::string(joined.status().message()));
  Fail(ProblemOf(joined.status()));
}

void WatchedWorld::Fail(Problem problem) {
  problem_ = std::move(problem);
  (void)SetRecording(false);
}

void WatchedWorld::TakeState(TimePoint now) {
  std::optional<InstanceFeed::State> latest = feed_.Latest(state_.number);
  if (!latest) return;
  const bool changed = state_.number == 0 || latest->instance.state() != state_.instance.state() ||
                       latest->instance.changes_size() != state_.instance.changes_size();
  status_due_ = status_due_ || changed;
  state_ = *std::move(latest);
  AddEvents();
  if (source_) source_->SetHosts(Hosts());
  if (const auto over = ProblemOf(state_.instance)) {
    MakeStatus(now);
    Fail(*over);
  }
}

// The instance keeps its newest events; those after the last one that is known are new.
void WatchedWorld::AddEvents() {
  const auto& events = state_.instance.events();
  auto fresh = events.begin();
  if (!news_.events.kept.empty()) {
    for (auto event = events.begin(); event != events.end(); ++event) {
      if (SameEvent(*event, news_.events.kept.back())) fresh = event + 1;
    }
  }
  const std::vector<v1::InstanceEvent> added(fresh, events.end());
  for (const v1::InstanceEvent& event : added) news_.events.Add(event, kMaxEventsKept);
  if (recording_.on && source_ && !added.empty()) (void)source_->client().Note(EventsMessage(added));
}

void WatchedWorld::MakeStatus(TimePoint now) {
  status_due_ = false;
  next_status_ = now + kStatusInterval;
  const double age_s = std::max(0.0, std::chrono::duration<double>(now - state_.since).count());
  news_.status = StatusMessage(state_.instance, age_s, source_ ? source_->Heard() : HeardRegions());
  ++news_.status_number;
  if (!recording_.on || !source_) return;
  (void)source_->client().Note(news_.status);
  recording_.bytes = source_->client().recorded_bytes();
  SayRecording();
}

// --- Recording -------------------------------------------------------------------------------------------------------

absl::Status WatchedWorld::SetRecording(bool on) {
  if (on == recording_wanted_) return absl::OkStatus();
  recording_wanted_ = on;
  if (on) {
    recording_ = {};
    const bool joined = source_ && source_->client().state() != client::ClientState::kJoining;
    const absl::Status begun = joined ? BeginRecording() : absl::OkStatus();
    recording_wanted_ = begun.ok();
    return begun;
  }
  if (!recording_.on || !source_) return absl::OkStatus();
  recording_.bytes = source_->client().recorded_bytes();
  recording_.on = false;
  const absl::Status stopped = source_->client().StopRecording();
  if (!stopped.ok()) recording_.problem = std::string(stopped.message());
  spdlog::info("recording ended instance={} file={} bytes={}", instance_, recording_.file, recording_.bytes);
  SayRecording();
  return stopped;
}

absl::Status WatchedWorld::BeginRecording() {
  const auto place = services_.recordings.Make(instance_, std::chrono::system_clock::now());
  absl::Status begun = place.status();
  if (begun.ok()) begun = source_->client().Record(place->path, place->max_bytes);
  recording_ = {.on = begun.ok(), .file = begun.ok() ? place->file : "", .bytes = 0, .problem = ""};
  if (begun.ok()) {
    spdlog::info("recording began instance={} file={}", instance_, recording_.file);
    if (news_.status_number > 0) (void)source_->client().Note(news_.status);
  } else {
    recording_.problem = std::string(begun.message());
  }
  SayRecording();
  return begun;
}

// As an event, which those who play the recording are sent as any other.
void WatchedWorld::NoteCorrection(PlayerNumber player, const std::string& correction, TimePoint now) {
  if (!recording_.on || !source_) return;
  if (now - corrections_since_ >= std::chrono::seconds(1)) {
    corrections_since_ = now;
    corrections_noted_ = 0;
  }
  if (++corrections_noted_ > kMaxCorrections_per_s) return;
  v1::InstanceEvent event;
  *event.mutable_time() = google::protobuf::util::TimeUtil::GetCurrentTime();
  event.set_text(absl::StrCat("player ", player.value(), ": prediction corrected by ", correction));
  (void)source_->client().Note(EventsMessage({event}));
}

void WatchedWorld::TickRecording() {
  if (!recording_.on) recording_wanted_ = BeginRecording().ok();
  const std::string ended = source_->TakeRecordingEnded();
  if (ended.empty()) return;
  spdlog::warn("recording ended instance={} file={} reason={}", instance_, recording_.file, ended);
  recording_wanted_ = recording_.on = false;
  recording_.problem = ended;
  SayRecording();
}

void WatchedWorld::SayRecording() {
  news_.recording = RecordingMessage(recording_);
  ++news_.recording_number;
}

std::map<RegionId, std::string> WatchedWorld::Hosts() const {
  std::map<RegionId, std::string> hosts;
  for (const v1::RegionStatus& status : state_.instance.region_status()) {
    hosts[RegionId(status.region())] = status.host();
  }
  return hosts;
}

}  // namespace tessera::gateway
