// Gateway: worlds, and who watches and plays in them; all but sockets.
//
//   Gateway gateway(options, background, metrics, wake);
//   const auto viewer = gateway.Open("plaza-1");                     // a socket opens; Close when it is gone
//   gateway.Receive(viewer, text, now);
//   every frame: for (ViewerId viewer : gateway.Tick(now)) AskForWritable(viewer);
//   on writable: while (auto message = gateway.Next(viewer, now)) ...;  if (gateway.Over(viewer)) close
//
// Thread rule: the event loop's.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/background.h"
#include "gateway/gateway_metrics.h"
#include "gateway/guest_shares.h"
#include "gateway/orders.h"
#include "gateway/played_recording.h"
#include "gateway/viewer_session.h"
#include "gateway/watched_world.h"
#include "trust/credentials.h"

namespace tessera::gateway {

struct GatewayOptions {
  trust::ControlPoint control;
  // The players' door, HOST:PORT#FINGERPRINT, where viewers play as guests or by tickets; empty: at `control`, which
  // takes no tickets unless it is a socket.
  std::string players_door;
  // A viewer that shows it gives orders by the rights of the socket `control`; empty: nobody does. At another control
  // plane viewers show access tokens instead.
  std::string key;
  bool takes_tokens = true;       // and tickets; false: they would come in the clear over a network
  bool sees_addresses = true;     // those of visitors; false: a proxy in front has one for all
  bool workers_are_here = false;  // orders may end workers, which are processes of this machine
  std::size_t max_viewers = 256, max_players = 64;
  double max_viewer_bytes_per_s = 4e6;
  std::string recordings_dir;  // empty: no recordings
  RecordingLimits recording_limits{};
};

using ViewerId = std::uint64_t;

class Gateway {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // `channel`: to the control plane of the options, by DialControl. `wake`: from any thread; the loop calls Tick soon.
  Gateway(GatewayOptions options, std::shared_ptr<grpc::Channel> channel, GatewayMetrics& metrics,
          std::function<void()> wake);
  // The end: players leave their worlds, which is waited for, for 2 s at most.
  void LeaveAll();

  // A viewer of the instance; one that is too many is sent the reason, and closed. `address`: of the visitor, in
  // digits; empty: it is not known.
  ViewerId Open(const std::string& instance, const std::string& address = "");
  // A viewer that plays a recording, of whatever name it gives; it counts as a player.
  ViewerId OpenRecording(const std::string& file);
  void Close(ViewerId viewer);
  void Receive(ViewerId viewer, std::string_view text, TimePoint now);
  void ReceiveBad(ViewerId viewer, const std::string& why, TimePoint now);

  // Carries all on; the viewers to whom something is to be sent.
  std::vector<ViewerId> Tick(TimePoint now);
  std::optional<OutgoingMessage> Next(ViewerId viewer, TimePoint now);
  bool Due(ViewerId viewer, TimePoint now) const;
  // The code to close with, once all is sent.
  std::optional<std::string> Over(ViewerId viewer) const;

  WorldList::List Worlds() const { return list_.Latest(); }
  // A tile of a world or recording that somebody watches, by its SHA-256; null: none has it. Who knows the hash was
  // sent the list.
  std::shared_ptr<const std::string> TileBy(const std::string& sha256) const;
  // Nobody watches, and nothing is recorded.
  bool idle() const;

  using Recorded = std::function<void(const absl::StatusOr<RecordingState>&)>;
  // Records the world, which need not be watched, or ends that; asked again, how far that is. `shown` is the key, or an
  // access token. `done` is called from here, or from Tick once the control plane has said who that is. Errors:
  // NOT_FOUND (no such instance), PERMISSION_DENIED and UNAUTHENTICATED (what was shown is not enough), those of
  // WatchedWorld::SetRecording, UNAVAILABLE (it ended unasked).
  void Record(const std::string& instance, bool on, const std::string& shown, Recorded done);
  std::vector<ListedRecording> Recordings() const { return services_.recordings.List(); }

 private:
  // A viewer that plays: a client of its own.
  struct Playing {
    std::unique_ptr<ViewSource> source;  // null while it joins
  };
  struct Viewer {
    std::string instance;
    std::string address{};
    std::shared_ptr<WatchedWorld> world{};  // null: it was one too many
    ViewerSession session{};
    std::optional<Playing> playing{};
    bool by_ticket = false;                     // that it plays, or wanted to
    std::unique_ptr<PlayedRecording> played{};  // instead of a world
    // To the control plane by the right that this viewer has shown; null: none. `token`: that right, empty for the key.
    std::shared_ptr<grpc::Channel> right{};
    std::string token{};
    bool authorizing = false;
  };
  struct World {
    std::shared_ptr<WatchedWorld> world;  // another one once it is over; its viewers keep the old one
    std::size_t viewers = 0;
    TimePoint unwatched_since{};
    bool due = false;  // a viewer wants a frame
  };

  Viewer* Admit(ViewerId& id);
  Problem PlayersFull() const;
  World& WorldOf(const std::string& instance);
  void Carry(ViewerId id, Viewer& viewer, const ViewerMessage& message, TimePoint now);
  void Join(ViewerId id, Viewer& viewer, const JoinWorld& join, TimePoint now);
  bool IsGuestAtDoor(const Viewer& viewer, const JoinWorld& join) const;
  client::JoinOptions JoinOptionsFor(const Viewer& viewer, const JoinWorld& join) const;
  void NotJoined(Viewer& viewer, const absl::Status& why);
  // Why no ticket is taken here; empty: tickets are taken.
  std::string TakesNoTickets() const;
  void Joined(ViewerId id, absl::StatusOr<std::unique_ptr<client::Client>> joined,
              std::shared_ptr<const SceneBook> book);
  void StopPlaying(Viewer& viewer);
  void Leave(std::unique_ptr<client::Client> client);
  void TakeRight(ViewerId id, Viewer& viewer, const Authorize& shown, TimePoint now);
  void TookRight(ViewerId id, const Authorize& shown, const absl::StatusOr<std::shared_ptr<grpc::Channel>>& right);
  void GiveOrder(ViewerId id, Viewer& viewer, const Order& order);
  void OrderDone(ViewerId id, const Order& order, const absl::StatusOr<std::string>& done);
  OrderContext ContextOf(const Viewer& viewer, const Order& order) const;
  // Which right an order needs here, and the line that says so: "token" or "key"; empty: no right helps.
  std::string Needs() const;
  absl::Status WithoutRight() const;
  absl::StatusOr<RecordingState> SetRecording(const std::string& instance, bool on);
  void TickPlayer(Viewer& viewer, TimePoint now);
  void TickWorlds(TimePoint now);

  GatewayOptions options_;
  GatewayMetrics& metrics_;
  Services services_;
  WorldList list_;
  std::map<std::string, World> worlds_;
  std::map<ViewerId, Viewer> viewers_;
  ViewerId last_viewer_ = 0;
  std::size_t players_ = 0;
  GuestShares guests_;
  Background background_;  // last: its jobs end before what they refer to
};

}  // namespace tessera::gateway
