#include "gateway/gateway.h"

#include <algorithm>
#include <future>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "gateway/visitor_right.h"

namespace tessera::gateway {
namespace {

using namespace std::chrono_literals;

// Joins and orders at once; most wait for the network.
constexpr std::size_t kBackgroundThreads = 8;
// A world that nobody watches is kept so long: pages are loaded anew.
constexpr auto kKeepUnwatched = 5s;
constexpr auto kPlayerJoinDeadline = 5s;
constexpr auto kLeaveDeadline = 2s;

// The control plane's word about a guest where none is taken begins so, after the instance's name.
bool IsTicketNeeded(const absl::Status& status) {
  return absl::IsUnauthenticated(status) && absl::StrContains(status.message(), "ticket: ");
}

}  // namespace

Gateway::Gateway(GatewayOptions options, std::shared_ptr<grpc::Channel> channel, GatewayMetrics& metrics,
                 std::function<void()> wake)
    : options_(std::move(options)),
      metrics_(metrics),
      services_{.control = options_.control, .channel = std::move(channel), .background = nullptr, .wake = wake},
      list_(services_.channel, options_.control.address),
      background_(kBackgroundThreads, wake) {
  services_.background = &background_;
  services_.recordings = RecordingFolder(options_.recordings_dir, options_.recording_limits);
}

void Gateway::LeaveAll() {
  std::vector<std::future<absl::Status>> leaving;
  for (auto& [id, viewer] : viewers_) {
    if (!viewer.playing || !viewer.playing->source) continue;
    viewer.session.Show(nullptr, nullptr);
    leaving.push_back(std::async(
        std::launch::async, [client = viewer.playing->source->TakeClient()] { return client->Leave(kLeaveDeadline); }));
    viewer.playing.reset();
    metrics_.players.Set(static_cast<double>(--players_));
  }
}

// Null: it is one too many, and was sent the reason.
Gateway::Viewer* Gateway::Admit(ViewerId& id) {
  id = ++last_viewer_;
  Viewer& viewer = viewers_[id];
  viewer.session.LimitBytes(options_.max_viewer_bytes_per_s);
  metrics_.viewers.Set(static_cast<double>(viewers_.size()));
  if (viewers_.size() <= options_.max_viewers) return &viewer;
  metrics_.refused_full.Increment();
  viewer.session.Report(
      {.code = "too_many_viewers",
       .text = absl::StrCat("this gateway has ", options_.max_viewers, " viewers; --max-viewers allows no more"),
       .again_s = 10},
      true);
  return nullptr;
}

Gateway::World& Gateway::WorldOf(const std::string& instance) {
  World& world = worlds_[instance];
  if (world.world == nullptr || world.world->problem()) {
    world.world = std::make_shared<WatchedWorld>(instance, services_);
    metrics_.worlds.Set(static_cast<double>(worlds_.size()));
  }
  return world;
}

ViewerId Gateway::Open(const std::string& instance, const std::string& address) {
  ViewerId id = 0;
  Viewer* const viewer = Admit(id);
  if (viewer == nullptr) return id;
  World& world = WorldOf(instance);
  ++world.viewers;
  viewer->instance = instance;
  viewer->address = options_.sees_addresses ? address : "";
  viewer->world = world.world;
  return id;
}

ViewerId Gateway::OpenRecording(const std::string& file) {
  ViewerId id = 0;
  Viewer* const viewer = Admit(id);
  if (viewer == nullptr) return id;
  if (players_ >= options_.max_players) {
    metrics_.refused_full.Increment();
    viewer->session.Report(PlayersFull(), true);
    return id;
  }
  viewer->played = std::make_unique<PlayedRecording>(file, services_.recordings.PathOf(file), services_);
  metrics_.players.Set(static_cast<double>(++players_));
  return id;
}

Problem Gateway::PlayersFull() const {
  return {.code = "full",
          .text = absl::StrCat("this gateway has ", players_, " players; --max-players allows no more"),
          .again_s = 5};
}

void Gateway::Close(ViewerId id) {
  const auto found = viewers_.find(id);
  if (found == viewers_.end()) return;
  Viewer& viewer = found->second;
  StopPlaying(viewer);
  if (viewer.played != nullptr) metrics_.players.Set(static_cast<double>(--players_));
  if (viewer.world != nullptr) {
    World& world = worlds_.at(viewer.instance);
    if (--world.viewers == 0) world.unwatched_since = std::chrono::steady_clock::now();
  }
  viewers_.erase(found);
  metrics_.viewers.Set(static_cast<double>(viewers_.size()));
}

// --- What viewers ask for --------------------------------------------------------------------------------------------

void Gateway::Receive(ViewerId id, std::string_view text, TimePoint now) {
  const auto found = viewers_.find(id);
  if (found == viewers_.end()) return;
  ViewerSession& session = found->second.session;
  const std::uint64_t bad = session.bad_messages();
  const std::optional<ViewerMessage> message = session.Receive(text, now);
  (session.bad_messages() == bad ? metrics_.messages : metrics_.bad_messages).Increment();
  if (message) Carry(id, found->second, *message, now);
}

void Gateway::ReceiveBad(ViewerId id, const std::string& why, TimePoint now) {
  const auto found = viewers_.find(id);
  if (found == viewers_.end()) return;
  metrics_.bad_messages.Increment();
  found->second.session.ReceiveBad(why, now);
}

void Gateway::Carry(ViewerId id, Viewer& viewer, const ViewerMessage& message, TimePoint now) {
  if (const auto* join = std::get_if<JoinWorld>(&message)) return Join(id, viewer, *join, now);
  if (std::holds_alternative<LeaveWorld>(message)) return StopPlaying(viewer);
  if (const auto* order = std::get_if<Order>(&message)) return GiveOrder(id, viewer, *order);
  if (const auto* shown = std::get_if<Authorize>(&message)) return TakeRight(id, viewer, *shown, now);
  if (const auto* play = std::get_if<PlayControl>(&message); play != nullptr && viewer.played != nullptr) {
    return viewer.played->Take(*play);
  }
  if (const auto* steer = std::get_if<Steer>(&message)) {
    if (viewer.playing && viewer.playing->source) viewer.playing->source->client().Steer(steer->steering);
  }
}

// The door counts it as one of the gateway's own address.
bool Gateway::IsGuestAtDoor(const Viewer& viewer, const JoinWorld& join) const {
  return !options_.players_door.empty() && join.ticket.empty() && viewer.token.empty();
}

// A viewer that has shown a right plays by that. Others come by the players' door, which takes tickets and guests of
// anybody, and where the gateway knows of none by the gateway's own right.
client::JoinOptions Gateway::JoinOptionsFor(const Viewer& viewer, const JoinWorld& join) const {
  client::JoinOptions options{.control_address = options_.control.address,
                              .instance_id = viewer.instance,
                              .player_name = join.name,
                              .deadline = kPlayerJoinDeadline,
                              .predict = true,
                              .credentials = options_.control.credentials,
                              .ticket = join.ticket};
  if (!options_.players_door.empty() && (!join.ticket.empty() || viewer.token.empty())) {
    options.control_address = options_.players_door;
    options.credentials = {};
  } else if (!viewer.token.empty()) {
    options.credentials.bearer_token = viewer.token;
  }
  return options;
}

std::string Gateway::TakesNoTickets() const {
  if (!options_.takes_tokens) {
    return "this gateway takes no tickets: they would come to it in the clear; it needs --certificate and --key, or "
           "--behind-proxy where a proxy in front of it speaks HTTPS";
  }
  if (options_.players_door.empty() && !IsSocket(options_.control.address)) {
    return "this gateway takes no tickets: it was not told where the players' door is (--players-door)";
  }
  return "";
}

void Gateway::Join(ViewerId id, Viewer& viewer, const JoinWorld& join, TimePoint now) {
  if (viewer.playing || viewer.world == nullptr) return;
  if (const std::string why = join.ticket.empty() ? "" : TakesNoTickets(); !why.empty()) {
    metrics_.tickets_refused.Increment();
    return viewer.session.ReportTicket(why, true, now);
  }
  if (players_ >= options_.max_players) {
    metrics_.refused_full.Increment();
    return viewer.session.Report(PlayersFull(), true);
  }
  if (IsGuestAtDoor(viewer, join) && !guests_.Take(now, viewer.address)) {
    metrics_.refused_address.Increment();
    return viewer.session.Report({.code = "full",
                                  .text = absl::StrCat("too many guests join from your address: ask again in ",
                                                       kGuestAgain_s, " s, or show a ticket"),
                                  .again_s = kGuestAgain_s},
                                 true);
  }
  const client::JoinOptions options = JoinOptionsFor(viewer, join);
  viewer.by_ticket = !join.ticket.empty();
  const ViewSource* watched = viewer.world->source();
  const std::shared_ptr<const SceneBook> book = watched == nullptr ? nullptr : watched->book();
  const bool queued = background_.Run([this, id, options, book]() -> Background::Done {
    auto joined = std::make_shared<absl::StatusOr<std::unique_ptr<client::Client>>>(client::Client::Join(options));
    std::shared_ptr<const SceneBook> encoded = book;
    if (joined->ok() && encoded == nullptr) encoded = std::make_shared<SceneBook>((**joined)->scene());
    return [this, id, joined, encoded] { Joined(id, std::move(*joined), encoded); };
  });
  if (!queued) {
    return viewer.session.Report({.code = "full", .text = "too many join at once", .again_s = 5}, true);
  }
  viewer.playing.emplace();
  metrics_.players.Set(static_cast<double>(++players_));
}

void Gateway::Joined(ViewerId id, absl::StatusOr<std::unique_ptr<client::Client>> joined,
                     std::shared_ptr<const SceneBook> book) {
  const auto found = viewers_.find(id);
  const bool waited_for = found != viewers_.end() && found->second.playing && !found->second.playing->source;
  if (!waited_for) {
    if (joined.ok()) Leave(*std::move(joined));
    return;
  }
  Viewer& viewer = found->second;
  if (!joined.ok()) {
    StopPlaying(viewer);
    return NotJoined(viewer, joined.status());
  }
  viewer.playing->source =
      std::make_unique<ViewSource>(*std::move(joined), std::move(book), viewer.instance, ++services_.last_generation);
  viewer.playing->source->SetHosts(viewer.world->Hosts());
  viewer.session.FollowBody(viewer.playing->source->client().own_body());
}

// A viewer that lacks a ticket, or shows one that does not count, watches on and may show another.
void Gateway::NotJoined(Viewer& viewer, const absl::Status& why) {
  const bool refused = absl::IsUnauthenticated(why) || absl::IsPermissionDenied(why) ||
                       (viewer.by_ticket && absl::IsInvalidArgument(why));
  if (refused && (viewer.by_ticket || IsTicketNeeded(why))) {
    metrics_.tickets_refused.Increment();
    return viewer.session.ReportTicket(std::string(why.message()), viewer.by_ticket, std::chrono::steady_clock::now());
  }
  viewer.session.Report(ProblemOf(why), true);
}

void Gateway::StopPlaying(Viewer& viewer) {
  if (!viewer.playing) return;
  viewer.session.Show(nullptr, viewer.world == nullptr ? nullptr : viewer.world->news());
  viewer.session.FollowBody(BodyId());
  if (viewer.playing->source) Leave(viewer.playing->source->TakeClient());
  viewer.playing.reset();
  metrics_.players.Set(static_cast<double>(--players_));
}

// Has the player's body removed, for which the control plane is waited for.
void Gateway::Leave(std::unique_ptr<client::Client> client) {
  const std::shared_ptr<client::Client> leaving = std::move(client);
  background_.Run([leaving]() -> Background::Done {
    (void)leaving->Leave(kLeaveDeadline);
    return nullptr;
  });
}

// --- Time passes -----------------------------------------------------------------------------------------------------

std::vector<ViewerId> Gateway::Tick(TimePoint now) {
  background_.Finish();
  for (auto& [id, viewer] : viewers_) {
    if (viewer.played != nullptr) viewer.played->Tick(now, viewer.session.WantsFrame(now));
    const bool watches = viewer.world != nullptr && !viewer.playing;
    if (watches && viewer.session.WantsFrame(now)) worlds_.at(viewer.instance).due = true;
  }
  TickWorlds(now);
  std::vector<ViewerId> due;
  for (auto& [id, viewer] : viewers_) {
    if (viewer.world != nullptr) {
      if (viewer.playing && viewer.playing->source) TickPlayer(viewer, now);
      const bool plays = viewer.playing && viewer.playing->source;
      viewer.session.Show(plays ? &viewer.playing->source->feed() : viewer.world->view(), viewer.world->news());
      if (viewer.world->problem()) viewer.session.Report(*viewer.world->problem(), true);
    }
    if (viewer.played != nullptr) {
      viewer.session.Show(viewer.played->view(), viewer.played->news());
      if (viewer.played->problem()) viewer.session.Report(*viewer.played->problem(), true);
    }
    if (viewer.session.Due(now)) due.push_back(id);
  }
  return due;
}

void Gateway::TickPlayer(Viewer& viewer, TimePoint now) {
  ViewSource& source = *viewer.playing->source;
  source.Poll(now);
  for (const std::string& correction : source.TakeCorrections()) {
    viewer.world->NoteCorrection(source.client().player(), correction, now);
  }
  if (!source.over()) {
    source.SetHosts(viewer.world->Hosts());
    const bool joined = source.client().state() != client::ClientState::kJoining;
    if (joined && viewer.session.WantsFrame(now)) source.Show(now);
    return;
  }
  const absl::Status why = source.WhyOver();
  Problem problem = ProblemOf(why);
  if (absl::IsAborted(why)) problem.code = "ended";     // the game's own words
  if (absl::IsUnavailable(why)) problem.code = "lost";  // its regions are silent, not the control plane
  StopPlaying(viewer);
  viewer.session.Report(std::move(problem), true);
}

void Gateway::TickWorlds(TimePoint now) {
  double recordings = 0;
  for (auto at = worlds_.begin(); at != worlds_.end();) {
    World& world = at->second;
    if (world.viewers == 0 && !world.world->recording() && now - world.unwatched_since > kKeepUnwatched) {
      at = worlds_.erase(at);
      metrics_.worlds.Set(static_cast<double>(worlds_.size()));
      continue;
    }
    world.world->Tick(now, std::exchange(world.due, false));
    recordings += world.world->recording_state().on ? 1 : 0;
    ++at;
  }
  metrics_.recordings.Set(recordings);
}

std::shared_ptr<const std::string> Gateway::TileBy(const std::string& sha256) const {
  for (const auto& [id, viewer] : viewers_) {
    const ViewFeed* view = viewer.world != nullptr ? viewer.world->view() : nullptr;
    if (viewer.played != nullptr) view = viewer.played->view();
    if (view == nullptr || view->book == nullptr) continue;
    if (auto tile = view->book->TileBy(sha256)) return tile;
  }
  return nullptr;
}

bool Gateway::idle() const {
  return viewers_.empty() && std::none_of(worlds_.begin(), worlds_.end(),
                                          [](const auto& world) { return world.second.world->recording(); });
}

std::optional<OutgoingMessage> Gateway::Next(ViewerId id, TimePoint now) {
  const auto found = viewers_.find(id);
  if (found == viewers_.end()) return std::nullopt;
  ViewerSession& session = found->second.session;
  const std::uint64_t frames = session.frames();
  const TimePoint begin = std::chrono::steady_clock::now();
  std::optional<OutgoingMessage> message = session.Next(now);
  if (!message) return std::nullopt;
  const auto bytes = static_cast<double>(message->bytes.size());
  if (session.frames() == frames) {
    metrics_.other_bytes.Increment(bytes);
  } else {
    metrics_.frames.Increment();
    metrics_.frame_bytes.Increment(bytes);
    if (const std::size_t deferred = session.last_frame().deferred; deferred > 0) {
      metrics_.limited_frames.Increment();
      metrics_.deferred_bodies.Increment(static_cast<double>(deferred));
    }
    metrics_.frame_seconds.Observe(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  return message;
}

bool Gateway::Due(ViewerId id, TimePoint now) const {
  const auto found = viewers_.find(id);
  return found != viewers_.end() && found->second.session.Due(now);
}

std::optional<std::string> Gateway::Over(ViewerId id) const {
  const auto found = viewers_.find(id);
  if (found == viewers_.end() || !found->second.session.over()) return std::nullopt;
  return found->second.session.close_code();
}

}  // namespace tessera::gateway
