// ViewSource: one client of a world, and the feed of those who look through its eyes: all viewers of a world share one,
// each player has one of its own.
//
//   ViewSource source(std::move(client), book, instance, generation);
//   loop: source.Poll(now); if (somebody is due) source.Show(now);
//
// Thread rule: one thread.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "client_sdk/client.h"
#include "gateway/gateway_message.h"
#include "gateway/picture.h"
#include "gateway/scene_book.h"
#include "gateway/viewer_session.h"

namespace tessera::gateway {

class ViewSource {
 public:
  // `generation` is of no other source of the process.
  ViewSource(std::unique_ptr<client::Client> client, std::shared_ptr<const SceneBook> book, const std::string& instance,
             std::uint64_t generation);

  ViewSource(const ViewSource&) = delete;
  ViewSource& operator=(const ViewSource&) = delete;

  void Poll(client::TimePoint now);
  // Makes the picture as of now.
  void Show(client::TimePoint now);
  // Shows a recording, whose time is not that of its viewers: as of `now` in it, for viewers at `taken_at`.
  void ShowRecorded(client::TimePoint now, client::TimePoint taken_at, bool paused);
  // Names of the hosts, for the map.
  void SetHosts(const std::map<RegionId, std::string>& hosts);
  // The regions that the client hears, with what they say of themselves.
  HeardRegions Heard() const;
  // Whether that has changed since the last call.
  bool TakeConnectedChanged() { return std::exchange(connected_changed_, false); }

  client::Client& client() { return *client_; }
  // Nothing else may be called until there is a client again.
  std::unique_ptr<client::Client> TakeClient() { return std::move(client_); }
  // Another one of the same scene and player.
  void SetClient(std::unique_ptr<client::Client> client);
  // Whether the client has ended, or no address that it knows answers: it is to be joined anew. A restored world has
  // been at later moments before, which none of its viewers may be shown as the same picture going on.
  bool over() const { return needs_grant_ || client_->state() == client::ClientState::kEnded; }
  absl::Status WhyOver() const;
  // Why a recording ended unasked, since the last call.
  std::string TakeRecordingEnded() { return std::exchange(recording_ended_, {}); }
  // Corrections of the player's prediction since the last call, each as a line.
  std::vector<std::string> TakeCorrections() { return std::exchange(corrections_, {}); }
  const ViewFeed& feed() const { return feed_; }
  const std::shared_ptr<const SceneBook>& book() const { return feed_.book; }

 private:
  void EncodeMap();
  void SayWorld();
  const PropertyValues& Values(const std::string& property, client::TimePoint now);

  std::unique_ptr<client::Client> client_;
  PictureMaker maker_;
  ViewFeed feed_;
  std::map<RegionId, std::string> hosts_;
  bool connected_changed_ = true, needs_grant_ = false;
  std::string recording_ended_;
  std::vector<std::string> corrections_;
  // By property, for all viewers that ask for it at about the same time.
  struct Taken {
    client::TimePoint at;
    PropertyValues values;
  };
  std::map<std::string, Taken> values_;
};

}  // namespace tessera::gateway
