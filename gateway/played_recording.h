// PlayedRecording: one viewer's way through a recording: its own time, which it stops, hurries and sets.
//
// It is read off the event loop: opening a file checks all of it, and going elsewhere plays some seconds. Meanwhile the
// viewer sees where it was. What the recording's gateway noted beside the world (figures and events) comes as news.
//
//   PlayedRecording played("plaza-1-20260101T000000Z.rec", path, services);
//   every frame: played.Tick(now, somebody_is_due);
//   session.Show(played.view(), played.news());
//
// Thread rule: the event loop's.
#pragma once

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "gateway/gateway_message.h"
#include "gateway/view_source.h"
#include "gateway/viewer_message.h"
#include "gateway/viewer_session.h"
#include "gateway/watched_world.h"

namespace tessera::gateway {

class PlayedRecording {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // `path` or why there is none, which is the problem then.
  PlayedRecording(std::string file, absl::StatusOr<std::string> path, Services& services);
  PlayedRecording(const PlayedRecording&) = delete;
  PlayedRecording& operator=(const PlayedRecording&) = delete;

  // `show`: the viewer is due, so the picture is to be new.
  void Tick(TimePoint now, bool show);
  void Take(const PlayControl& control);

  const ViewFeed* view() const { return source_ ? &source_->feed() : nullptr; }
  const NewsFeed* news() const { return &news_; }
  const std::optional<Problem>& problem() const { return problem_; }

 private:
  using Time = std::chrono::microseconds;
  // Events of the world, as its gateway reported them to its viewers then.
  struct ToldEvents {
    Time at{};
    nlohmann::json events;
    bool passed_on = false;
  };
  // The result of a job: a client at a place in the recording.
  struct Arrived {
    std::unique_ptr<client::Client> client;
    std::shared_ptr<const SceneBook> book;
    std::vector<std::string> notes;
    std::vector<ToldEvents> told{};  // all of the recording, by the job that opened it
  };

  static absl::StatusOr<std::vector<ToldEvents>> ReadEvents(const std::string& path);
  static absl::StatusOr<Arrived> Travel(std::unique_ptr<client::Client> playing, const std::string& path, Time place,
                                        std::shared_ptr<const SceneBook> book);
  void GoTo(Time place);
  void Arrive(absl::StatusOr<Arrived> arrived, Time place);
  void Fail(const absl::Status& status);
  void Advance(Time to);
  void TakeNotes(const std::vector<std::string>& notes);
  void PassEventsOn();
  void AddEvents(const nlohmann::json& events);
  void SayPlace(TimePoint now);

  Services& services_;
  std::string path_;
  std::unique_ptr<ViewSource> source_;
  NewsFeed news_;
  std::vector<ToldEvents> told_;  // ascending
  PlayState said_;
  std::optional<Problem> problem_;
  bool under_way_ = false;      // a job has the client
  std::optional<Time> wanted_;  // where to go next
  Time at_{}, length_{};
  std::optional<Time> shown_at_;
  std::optional<TimePoint> last_tick_;
  TimePoint next_word_{};
  // Jobs that end when this is gone must not touch it.
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace tessera::gateway
