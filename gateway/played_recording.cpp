#include "gateway/played_recording.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_replace.h"
#include "client_sdk/recording.h"
#include "gateway/viewer_format.h"
#include "spdlog/spdlog.h"
#include "telemetry/log_value.h"

namespace tessera::gateway {
namespace {

using namespace std::chrono_literals;
using client::Client;

constexpr auto kWordInterval = 250ms;
// A loop that stood still for longer goes on from there.
constexpr auto kLongestStep = 250ms;

// The recording's time as its client's clock.
client::TimePoint Moment(std::chrono::microseconds at) { return client::TimePoint(1h) + at; }

std::map<RegionId, std::string> HostsIn(const nlohmann::json& status) {
  std::map<RegionId, std::string> hosts;
  const auto regions = status.find("regions");
  if (regions == status.end() || !regions->is_array()) return hosts;
  for (const nlohmann::json& region : *regions) {
    if (!region.is_object()) continue;
    const auto id = region.find("region"), host = region.find("host");
    if (id == region.end() || host == region.end() || !id->is_number_unsigned() || !host->is_string()) continue;
    hosts[RegionId(id->get<std::uint32_t>())] = host->get<std::string>();
  }
  return hosts;
}

}  // namespace

PlayedRecording::PlayedRecording(std::string file, absl::StatusOr<std::string> path, Services& services)
    : services_(services) {
  said_.file = std::move(file);
  path_ = said_.file;
  if (path.ok()) {
    path_ = *std::move(path);
    GoTo(Time(0));
  } else {
    Fail(path.status());
  }
}

// A key says how the world is and not what has happened, so all that did is read once.
absl::StatusOr<std::vector<PlayedRecording::ToldEvents>> PlayedRecording::ReadEvents(const std::string& path) {
  auto reader = client::RecordingReader::Open(path);
  if (!reader.ok()) return reader.status();
  std::vector<ToldEvents> told;
  while (true) {
    const auto entry = reader->Next();
    if (!entry.ok()) return entry.status();
    if (!entry->has_value()) return told;
    const auto* note = std::get_if<client::NoteEntry>(&(*entry)->what);
    if (note == nullptr) continue;
    auto message = nlohmann::json::parse(note->text, nullptr, false);
    if (!message.is_object() || message.value("type", nlohmann::json()) != "events") continue;
    const auto events = message.find("events");
    if (events != message.end() && events->is_array()) told.push_back({(*entry)->at, std::move(*events)});
  }
}

// Off the loop: may take a second.
absl::StatusOr<PlayedRecording::Arrived> PlayedRecording::Travel(std::unique_ptr<Client> playing,
                                                                 const std::string& path, Time place,
                                                                 std::shared_ptr<const SceneBook> book) {
  Arrived arrived;
  if (playing == nullptr) {
    auto opened = Client::Play(path);
    if (!opened.ok()) return opened.status();
    playing = *std::move(opened);
    auto told = ReadEvents(path);
    if (!told.ok()) return told.status();
    arrived.told = *std::move(told);
  }
  if (absl::Status status = playing->Seek(place); !status.ok()) return status;
  const client::TimePoint moment = Moment(std::min(place, *playing->length()));
  playing->Poll(moment);
  if (!playing->reason().ok()) return playing->reason();
  playing->Interpolated(moment);
  if (book == nullptr) book = std::make_shared<SceneBook>(playing->scene());
  arrived.book = std::move(book);
  arrived.notes = playing->TakeNotes();
  arrived.client = std::move(playing);
  return arrived;
}

void PlayedRecording::GoTo(Time place) {
  wanted_ = place;
  if (under_way_) return;
  const auto held = std::make_shared<std::unique_ptr<Client>>(source_ ? source_->TakeClient() : nullptr);
  const std::shared_ptr<const SceneBook> book = source_ ? source_->book() : nullptr;
  under_way_ = services_.background->Run(
      [this, held, book, place, path = path_, alive = std::weak_ptr<bool>(alive_)]() -> Background::Done {
        auto arrived = std::make_shared<absl::StatusOr<Arrived>>(Travel(std::move(*held), path, place, book));
        return [this, alive, arrived, place] {
          if (!alive.expired()) Arrive(std::move(*arrived), place);
        };
      });
  if (!under_way_ && source_) source_->SetClient(std::move(*held));
}

void PlayedRecording::Arrive(absl::StatusOr<Arrived> arrived, Time place) {
  under_way_ = false;
  if (!arrived.ok()) return Fail(arrived.status());
  if (wanted_ == place) wanted_.reset();
  length_ = *arrived->client->length();
  at_ = std::min(place, length_);
  shown_at_.reset();
  if (source_) {
    source_->SetClient(std::move(arrived->client));
  } else {
    source_ = std::make_unique<ViewSource>(std::move(arrived->client), std::move(arrived->book), said_.file,
                                           ++services_.last_generation);
  }
  if (!arrived->told.empty()) told_ = std::move(arrived->told);
  TakeNotes(arrived->notes);
  PassEventsOn();
  next_word_ = {};
}

void PlayedRecording::Fail(const absl::Status& status) {
  spdlog::info("recording not played file={} reason={}", telemetry::LogValue(said_.file),
               telemetry::LogValue(std::string(status.message())));
  // Viewers know it by its name, and nothing of the gateway's folders.
  problem_ = {.code = absl::IsNotFound(status) ? "no_recording" : "damaged",
              .text = absl::StrReplaceAll(status.message(), {{path_, said_.file}})};
}

void PlayedRecording::Take(const PlayControl& control) {
  said_.speed = control.speed.value_or(said_.speed);
  if (control.at_s) wanted_ = Time(std::llround(*control.at_s * 1e6));
  if (control.paused) {
    // From its end it begins again.
    if (said_.paused && !*control.paused && source_ && at_ >= length_ && !wanted_) wanted_ = Time(0);
    said_.paused = *control.paused;
  }
  if (control.step && source_) {
    said_.paused = true;
    const double tick_s = 1.0 / static_cast<double>(source_->client().scene().tick_rate_hz);
    wanted_ = std::clamp(wanted_.value_or(at_) + Time(std::llround(*control.step * tick_s * 1e6)), Time(0), length_);
  }
  next_word_ = {};
}

void PlayedRecording::Tick(TimePoint now, bool show) {
  const auto passed = std::clamp<TimePoint::duration>(now - last_tick_.value_or(now), 0s, kLongestStep);
  last_tick_ = now;
  if (problem_ || under_way_) return;
  const bool has_source = source_ != nullptr;
  if (wanted_ && has_source && *wanted_ >= at_ && *wanted_ - at_ <= kLongestStep) {
    Advance(*std::exchange(wanted_, std::nullopt));
  } else if (wanted_) {
    return GoTo(*wanted_);
  } else if (has_source && !said_.paused) {
    Advance(at_ + std::chrono::duration_cast<Time>(passed * said_.speed));
  }
  if (!has_source || problem_) return;
  if (show) {
    source_->ShowRecorded(Moment(at_), now, shown_at_ == at_);
    shown_at_ = at_;
  }
  SayPlace(now);
}

void PlayedRecording::Advance(Time to) {
  at_ = std::min(to, length_);
  if (at_ == length_) said_.paused = true;
  source_->Poll(Moment(at_));
  if (!source_->client().reason().ok()) return Fail(source_->client().reason());
  TakeNotes(source_->client().TakeNotes());
  PassEventsOn();
}

// The status that its gateway sent its viewers.
void PlayedRecording::TakeNotes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) {
    const auto message = nlohmann::json::parse(note, nullptr, false);
    if (!message.is_object() || message.value("type", nlohmann::json()) != "status") continue;
    news_.status = note;
    ++news_.status_number;
    source_->SetHosts(HostsIn(message));
  }
}

// The newest of those that had happened by now, each once, however often its moment is come by.
void PlayedRecording::PassEventsOn() {
  const auto end = std::ranges::upper_bound(told_, at_, {}, &ToldEvents::at);
  const auto begin = end - std::min<std::ptrdiff_t>(end - told_.begin(), kMaxEventsKept);
  for (auto told = begin; told != end; ++told) {
    if (!std::exchange(told->passed_on, true)) AddEvents(told->events);
  }
}

void PlayedRecording::AddEvents(const nlohmann::json& events) {
  for (const nlohmann::json& event : events) {
    if (!event.is_object() || !event.value("text", nlohmann::json()).is_string()) continue;
    v1::InstanceEvent added;
    added.set_text(event["text"].get<std::string>());
    const nlohmann::json time = event.value("time", nlohmann::json());
    if (!time.is_string() ||
        !google::protobuf::util::TimeUtil::FromString(time.get<std::string>(), added.mutable_time())) {
      continue;
    }
    news_.events.Add(std::move(added), kMaxEventsKept);
  }
}

void PlayedRecording::SayPlace(TimePoint now) {
  if (now < next_word_) return;
  next_word_ = now + kWordInterval;
  said_.length_s = std::chrono::duration<double>(length_).count();
  said_.at_s = std::chrono::duration<double>(at_).count();
  std::string word = PlayMessage(said_);
  if (word == news_.play) return;
  news_.play = std::move(word);
  ++news_.play_number;
}

}  // namespace tessera::gateway
