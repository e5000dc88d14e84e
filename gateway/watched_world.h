// WatchedWorld: one world that viewers watch: joined once, whoever watches, and joined again when it comes back.
//
// It is there while somebody watches it. A join that fails, or a world that ends, is a problem, with which its viewers
// are closed; they may come again, to a new one.
//
//   WatchedWorld world("plaza-1", services);
//   every frame: world.Tick(now, somebody_is_due);
//   session.Show(world.view(), world.news());
//
// Thread rule: the event loop's.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "gateway/background.h"
#include "gateway/gateway_message.h"
#include "gateway/instance_feed.h"
#include "gateway/recording_folder.h"
#include "gateway/view_source.h"
#include "gateway/viewer_session.h"
#include "trust/credentials.h"

namespace tessera::gateway {

// Things that worlds and players share.
struct Services {
  trust::ControlPoint control;
  std::shared_ptr<grpc::Channel> channel;
  Background* background = nullptr;
  std::function<void()> wake;
  std::uint64_t last_generation = 0;
  RecordingFolder recordings{"", {}};
};

class WatchedWorld {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  WatchedWorld(std::string instance, Services& services);
  WatchedWorld(const WatchedWorld&) = delete;
  WatchedWorld& operator=(const WatchedWorld&) = delete;

  // `show`: a viewer is due, so the picture is to be new.
  void Tick(TimePoint now, bool show);

  const std::string& instance() const { return instance_; }
  const ViewFeed* view() const { return source_ ? &source_->feed() : nullptr; }
  const NewsFeed* news() const { return &news_; }
  const std::optional<Problem>& problem() const { return problem_; }
  // The newest that is known of the instance; null before the first.
  const v1::Instance* state() const { return state_.number == 0 ? nullptr : &state_.instance; }
  // Null while it is being joined.
  const ViewSource* source() const { return source_.get(); }
  std::map<RegionId, std::string> Hosts() const;

  // Records what the world's viewers are sent, from its next frame on, whoever watches, until it is switched off or the
  // world ends; a world that is lost and comes back goes on in another file. Errors: those of RecordingFolder::Make and
  // Client::Record; nothing is recorded then.
  absl::Status SetRecording(bool on);
  // Writes a correction of a player's prediction into the recording, if there is one; at most 20 a second.
  void NoteCorrection(PlayerNumber player, const std::string& correction, TimePoint now);
  bool recording() const { return recording_wanted_; }
  const RecordingState& recording_state() const { return recording_; }

 private:
  void Fail(Problem problem);
  absl::Status BeginRecording();
  void TickRecording();
  void SayRecording();
  void Join(TimePoint now);
  void Joined(absl::StatusOr<std::unique_ptr<client::Client>> joined, std::shared_ptr<const SceneBook> book);
  void TakeState(TimePoint now);
  void AddEvents();
  void MakeStatus(TimePoint now);

  std::string instance_;
  Services& services_;
  InstanceFeed feed_;
  InstanceFeed::State state_;
  NewsFeed news_;
  std::unique_ptr<ViewSource> source_;
  std::shared_ptr<const SceneBook> book_;  // from the last join
  const Scene* book_scene_ = nullptr;
  std::optional<Problem> problem_;
  bool joining_ = false, status_due_ = true;
  TimePoint next_status_{}, next_join_{};
  std::optional<TimePoint> lost_since_;
  bool recording_wanted_ = false;
  RecordingState recording_;
  TimePoint corrections_since_{};  // a second of them, and how many were noted in it
  int corrections_noted_ = 0;
  // Jobs that end when this is gone must not touch it.
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace tessera::gateway
