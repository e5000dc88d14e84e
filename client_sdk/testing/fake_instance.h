// Test double of an instance: a control plane's SessionService on a Unix socket, and regions that speak the real
// protocol over real sockets but whose worlds the test moves by hand.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "client_sdk/testing/fake_tiles.h"
#include "client_sdk/testing/streaming_sessions.h"
#include "core/replication/command.h"
#include "core/replication/datagram.h"
#include "core/replication/input.h"
#include "core/replication/scene_transfer.h"
#include "core/replication/snapshot.h"
#include "core/world/byte_view.h"
#include "core/world/packed_scene.h"
#include "core/world/partition_io.h"
#include "core/world/scene_load.h"
#include "core/world/sha256.h"
#include "core/world/viewer_number.h"
#include "host/temporary_folder.h"
#include "net/credential.h"
#include "net/endpoint.h"
#include "net/join_grant.h"
#include "net/testing/test_identity.h"
#include "tessera/v1/game.pb.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::client {

constexpr std::uint32_t kTickRate = 60, kSnapshotRate = 30;

// A test decides itself what it shows, so interest has no radius; its clock goes by snapshots, so every one is sent.
inline replication::SnapshotSettings ShowsAll(const Scene& scene) {
  replication::SnapshotSettings settings = replication::SnapshotSettingsFor(scene);
  settings.interest_radius_m = 0;
  settings.idle_ticks = 0;
  return settings;
}

// One region. Poll with Service; what clients send is gathered.
class FakeRegion {
 public:
  FakeRegion(RegionId self, const Scene& scene, const PartitionMap& map, const net::SigningKey& key,
             const std::string& instance_id, std::uint16_t port = 0, Incarnation incarnation = Incarnation(1))
      : self_(self),
        incarnation_(incarnation),
        map_(map),
        endpoint_(*net::Endpoint::Create({.bind_address = "127.0.0.1", .port = port})),
        settings_(ShowsAll(scene)),
        history_(scene.bounds, settings_),
        level_(PackLevel(scene)) {
    endpoint_->Open(net::TestWorker(key, instance_id, self, incarnation));
  }

  RegionId id() const { return self_; }
  Incarnation incarnation() const { return incarnation_; }
  std::uint16_t port() const { return endpoint_->port(); }
  std::size_t clients() const { return senders_.size(); }
  std::uint64_t logins_refused() const { return endpoint_->acceptor_stats().refused; }

  bool started = false;
  std::optional<v1::RegionRefusal> refuse_all;
  PlayerNumber welcome_as;                        // somebody else, where set
  std::vector<PlayerInput> inputs;                // new ones, as they came
  std::map<std::uint32_t, std::string> commands;  // by number
  std::uint32_t last_event = 0;                   // that the client says to have
  double drop_share = 0;                          // share of snapshot datagrams; every n-th
  bool drops_last = false;                        // datagram of each snapshot
  replication::ClientView view;                   // each client's
  std::optional<std::uint32_t> applied;           // last, as snapshots say; nothing: the newest that came
  // The scene, for those who ask: so many bytes a chunk, and chunks until it falls silent.
  std::size_t scene_chunk_bytes = replication::kMaxSceneChunkBytes;
  std::size_t scene_chunks_left = ~std::size_t{0};
  bool other_scene = false, spoiled_scene = false;        // refuses; sends what does not have the digest
  std::vector<replication::SceneRequest> scene_requests;  // as they came
  std::uint64_t scene_sent = 0;                           // bytes
  FakeTiles tiles;                                        // the level's

  void Service() {
    for (const net::Event& event : endpoint_->Service(std::chrono::milliseconds(0))) {
      if (event.kind == net::Event::Kind::kDisconnected) senders_.erase(event.peer);
      if (event.kind == net::Event::Kind::kConnected) OnConnected(event);
      if (event.kind == net::Event::Kind::kMessage) OnInput(event);
    }
  }
  // Another region is behind this address from now on.
  void BecomeAnother(const net::SigningKey& key, const std::string& instance_id) {
    endpoint_->Open(net::TestWorker(key, instance_id, RegionId(99), Incarnation(9)));
    for (const auto& [peer, sender] : senders_) endpoint_->Disconnect(peer);
    senders_.clear();
  }
  void Start(Tick tick) {
    started = true;
    v1::RegionControl message;
    message.mutable_started()->set_tick(tick.value());
    TellAll(message);
  }
  void Stop(const std::string& why, bool goes_on = false) {
    v1::RegionControl message;
    message.mutable_stopping()->set_reason(why);
    message.mutable_stopping()->set_goes_on(goes_on);
    TellAll(message);
    for (const auto& [peer, sender] : senders_) endpoint_->Disconnect(peer);
    senders_.clear();
  }
  void TellMap(const PartitionMap& map, const std::vector<v1::RegionEndpoint>& endpoints = {}) {
    v1::RegionControl message;
    *message.mutable_map()->mutable_map() = ToProto(map);
    message.mutable_map()->mutable_endpoints()->Assign(endpoints.begin(), endpoints.end());
    TellAll(message);
  }
  void TellClock(bool paused, double ticks_per_second, Tick tick) {
    v1::RegionControl message;
    message.mutable_clock()->set_paused(paused);
    message.mutable_clock()->set_ticks_per_second(ticks_per_second);
    message.mutable_clock()->set_tick(tick.value());
    TellAll(message);
  }
  void TellNews(const v1::PlayerNews& news) {
    v1::RegionControl message;
    *message.mutable_player_news() = news;
    TellAll(message);
  }
  void TellWorld(std::uint32_t epoch, std::uint64_t tick, const std::vector<std::uint8_t>& properties) {
    v1::RegionControl message;
    message.mutable_world_news()->set_epoch(epoch);
    message.mutable_world_news()->set_tick(tick);
    message.mutable_world_news()->set_properties(properties.data(), properties.size());
    TellAll(message);
  }
  void TellEnded(const std::string& why) {
    v1::RegionControl message;
    message.mutable_session_ended()->set_reason(why);
    TellAll(message);
  }
  void RefuseCommand(std::uint32_t number, const std::string& why, bool for_good) {
    v1::RegionControl message;
    message.mutable_command_refused()->set_number(number);
    message.mutable_command_refused()->set_detail(why);
    message.mutable_command_refused()->set_for_good(for_good);
    TellAll(message);
  }
  struct Pair {
    BodyId a, b;
    bool trigger = false, begin = true;
  };
  void TellPairs(Tick tick, const std::vector<Pair>& pairs, bool whole = false) {
    v1::RegionControl message;
    message.mutable_pair_events()->set_tick(tick.value());
    message.mutable_pair_events()->set_whole(whole);
    for (const Pair& pair : pairs) {
      v1::PairEvent& event = *message.mutable_pair_events()->add_events();
      event.set_body_a(pair.a.value());
      event.set_body_b(pair.b.value());
      event.set_trigger(pair.trigger);
      event.set_begin(pair.begin);
    }
    TellAll(message);
  }
  v1::RegionEndpoint Where() const {
    v1::RegionEndpoint endpoint;
    endpoint.set_region(self_.value());
    endpoint.set_host("127.0.0.1");
    endpoint.set_game_port(port());
    endpoint.set_incarnation(incarnation_.value());
    return endpoint;
  }
  void SendFigures(std::span<const std::uint8_t> datagram) {
    for (const auto& [peer, sender] : senders_) (void)endpoint_->Send(peer, net::Delivery::kUnsequenced, datagram);
    endpoint_->Flush();
  }
  void Snapshot(Tick tick, std::span<const replication::BodyRecord> bodies,
                std::span<const replication::DepartureRecord> departures = {}) {
    history_.Push(tick, bodies, departures);
    for (auto& [peer, sender] : senders_) {
      if (holds_[peer]) {  // its snapshots begin from nothing
        sender = replication::SnapshotSender(settings_);
        continue;
      }
      const auto written = sender.Write(history_, view, applied.value_or(last_input_), 0).datagrams;
      for (const net::Bytes& bytes : written) {
        if (drops_last && &bytes == &written.back()) continue;
        dropped_ += drop_share;
        if (dropped_ >= 1) {
          dropped_ -= 1;
          continue;
        }
        (void)endpoint_->Send(peer, net::Delivery::kUnsequenced, bytes);
      }
    }
    endpoint_->Flush();
  }

 private:
  void Tell(net::PeerHandle peer, const v1::RegionControl& message) {
    const std::string bytes = message.SerializeAsString();
    (void)endpoint_->Send(peer, net::Delivery::kReliable,
                          {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  }
  void TellAll(const v1::RegionControl& message) {
    for (const auto& [peer, sender] : senders_) Tell(peer, message);
    endpoint_->Flush();
  }
  void Refuse(net::PeerHandle peer, v1::RefusalReason reason, const std::string& detail) {
    v1::RegionControl message;
    message.mutable_refusal()->set_reason(reason);
    message.mutable_refusal()->set_detail(detail);
    Tell(peer, message);
    endpoint_->Disconnect(peer);
  }

  void OnConnected(const net::Event& event) {
    if (refuse_all) return Refuse(event.peer, refuse_all->reason(), refuse_all->detail());
    if (IsReplaced(event.who)) return Refuse(event.peer, v1::REFUSAL_REASON_REPLACED, "");
    senders_.emplace(event.peer, replication::SnapshotSender(settings_));
    players_[event.peer] = event.who.player;
    v1::RegionControl message;
    v1::RegionWelcome& welcome = *message.mutable_welcome();
    welcome.set_region(self_.value());
    welcome.set_incarnation(incarnation_.value());
    welcome.set_player(welcome_as != PlayerNumber() ? welcome_as.value() : event.who.player.value());
    welcome.set_tick_rate_hz(kTickRate);
    welcome.set_snapshot_rate_hz(kSnapshotRate);
    welcome.set_started(started);
    *welcome.mutable_map() = ToProto(map_);
    Tell(event.peer, message);
  }

  // Whether a newer process of the player was here; an older one is refused now.
  bool IsReplaced(const net::PeerIdentity& who) {
    net::Generation& newest = generations_[who.player];
    if (who.generation <= newest) return who.generation < newest;
    newest = who.generation;
    for (const auto& [peer, player] : players_) {
      if (player == who.player && senders_.erase(peer) > 0) Refuse(peer, v1::REFUSAL_REASON_REPLACED, "");
    }
    return false;
  }

  // As a region does: what was sent on a connection is not sent there again.
  void OnSceneRequest(const net::Event& event) {
    const auto request = replication::DecodeSceneRequest(event.bytes);
    ASSERT_TRUE(request.ok()) << request.status();
    scene_requests.push_back(*request);
    holds_[event.peer] = request->want != replication::SceneRequest::Want::kHave;
    if (request->want != replication::SceneRequest::Want::kSend) return;
    if (other_scene) {
      SendReliable(event.peer, replication::EncodeSceneRefusal("the region runs another scene"));
      return;
    }
    std::uint64_t& sent = sent_to_.try_emplace(event.peer, request->offset).first->second;
    const std::uint64_t end =
        std::min<std::uint64_t>(level_.scene.size(), request->offset + replication::kSceneWindowBytes);
    for (; sent < end && scene_chunks_left > 0; --scene_chunks_left) {
      const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(scene_chunk_bytes, end - sent));
      const auto from = level_.scene.begin() + static_cast<std::ptrdiff_t>(sent);
      std::vector<std::uint8_t> part(from, from + static_cast<std::ptrdiff_t>(size));
      if (spoiled_scene) part.back() ^= 1;
      SendReliable(event.peer,
                   replication::EncodeSceneChunk({.total_bytes = level_.scene.size(),
                                                  .sha256 = *replication::DigestFrom(Sha256Hex(AsText(level_.scene))),
                                                  .offset = sent,
                                                  .bytes = part}));
      sent += size;
      scene_sent += size;
    }
  }
  void OnTileRequest(const net::Event& event) {
    const auto request = replication::DecodeTileRequest(event.bytes);
    ASSERT_TRUE(request.ok()) << request.status();
    tiles.Serve(level_.tiles, event.peer, *request, [&](const replication::TileChunk& part) {
      SendReliable(event.peer, replication::EncodeTileChunk(part));
    });
  }
  void SendReliable(net::PeerHandle peer, std::span<const std::uint8_t> bytes) {
    (void)endpoint_->Send(peer, net::Delivery::kReliable, bytes);
  }

  void OnInput(const net::Event& event) {
    if (replication::KindOf(event.bytes) == replication::DatagramKind::kTileRequest) return OnTileRequest(event);
    if (replication::KindOf(event.bytes) == replication::DatagramKind::kSceneRequest) return OnSceneRequest(event);
    const auto sender = senders_.find(event.peer);
    if (const auto message = replication::DecodeCommands(event.bytes); message.ok()) {
      last_event = message->last_event;
      std::uint32_t number = message->base;
      for (const replication::Command& command : message->commands) commands[number++] = command.bytes;
      return;
    }
    const auto message = replication::DecodeInput(event.bytes);
    if (sender == senders_.end() || !message.ok()) return;
    EXPECT_TRUE(sender->second.Acknowledge(message->ack).ok());
    for (const PlayerInput& input : message->inputs) {
      if (input.number <= last_input_) continue;
      last_input_ = input.number;
      if (input.body == PlayerBodyId(players_[event.peer])) {
        inputs.push_back(input);
        continue;
      }
      v1::RegionControl refused;
      refused.mutable_input_refused()->set_body(input.body.value());
      refused.mutable_input_refused()->set_input_number(input.number);
      refused.mutable_input_refused()->set_detail("not yours");
      Tell(event.peer, refused);
    }
  }

  RegionId self_;
  Incarnation incarnation_;
  PartitionMap map_;
  std::unique_ptr<net::Endpoint> endpoint_;
  replication::SnapshotSettings settings_;
  replication::SnapshotHistory history_;
  std::map<net::PeerHandle, replication::SnapshotSender> senders_;
  const PackedLevel level_;
  std::map<net::PeerHandle, std::uint64_t> sent_to_;
  std::map<net::PeerHandle, bool> holds_;
  std::map<net::PeerHandle, PlayerNumber> players_;
  std::map<PlayerNumber, net::Generation> generations_;
  std::uint32_t last_input_ = 0;
  double dropped_ = 0;
};

// The list that a menu shows: whatever the test puts there, before it is asked for.
struct FakeInstanceList {
  std::vector<v1::Instance> instances;
};

class FakeInstance : public StreamingSessions {
 public:
  static constexpr const char* kId = "plaza-1";
  static constexpr const char* kTicket = "good";  // the only one that it takes

  explicit FakeInstance(std::uint32_t count, const std::string& more = "") {
    const auto loaded = LoadScene(
        SceneForm::kText, more + R"(name: "plaza" bounds { min { x: -50 y: -5 z: -50 } max { x: 50 y: 50 z: 50 } }
      properties { name: "health" number: 100 } properties { name: "team" text: "none" }
      properties { name: "home" vector { x: 1 y: 2 z: 3 } } properties { name: "target" body: 0 }
      properties { name: "secret" bytes: "\001\000\377" }
      instance_properties { name: "goals" number: 0 } instance_properties { name: "phase" text: "waiting" }
      bodies { id: 1 mass: 1 shape { sphere { radius: 0.5 } } properties { name: "team" text: "red" } }
      player { body { mass: 1 shape { sphere { radius: 0.5 } } } spawn_points { y: 1 } max_force: 10 max_speed: 5 })",
        "plaza.textproto");
    EXPECT_TRUE(loaded.ok()) << loaded.status();
    scene_bytes_ = loaded->message.SerializeAsString();
    scene_hash_ = loaded->hash;
    scene = loaded->scene;
    map = *MakeGridMap(scene->ground(), count);
    for (std::uint32_t i = 1; i <= count; ++i) {
      regions.push_back(std::make_unique<FakeRegion>(RegionId(i), *scene, map, key_, kId));
    }
    grpc::ServerBuilder builder;
    address = "unix:" + folder_.path() + "/control.sock";
    builder.AddListeningPort(address, grpc::InsecureServerCredentials());
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~FakeInstance() override { server_->Shutdown(); }

  // Replaces a region by a new process on the same port.
  void Restart(std::size_t index) {
    const std::lock_guard lock(regions_change_);
    const std::uint16_t port = regions[index]->port();
    regions[index].reset();
    regions[index] = std::make_unique<FakeRegion>(map.regions()[index].id, *scene, map, key_, kId, port);
  }
  // As if the process had died, or all of them.
  void End(std::size_t index) {
    const std::lock_guard lock(regions_change_);
    regions.erase(regions.begin() + static_cast<std::ptrdiff_t>(index));
  }
  void EndAll() {
    const std::lock_guard lock(regions_change_);
    regions.clear();
  }
  // A region that the map has not had, or a further life of one: on a port of its own.
  FakeRegion& Add(RegionId id, Incarnation incarnation = Incarnation(1)) {
    const std::lock_guard lock(regions_change_);
    regions.push_back(std::make_unique<FakeRegion>(id, *scene, map, key_, kId, 0, incarnation));
    return *regions.back();
  }
  std::string packed_scene() const { return std::string(AsText(PackLevel(*scene).scene)); }
  // The grant that the control plane would give to a new player, to a viewer, or to one who is in already.
  std::vector<std::uint8_t> Grant(bool viewer = false, PlayerNumber again = PlayerNumber()) {
    const PlayerNumber player = viewer                    ? PlayerNumber(kFirstViewer + 5)
                                : again != PlayerNumber() ? again
                                                          : PlayerNumber(++players_);
    net::JoinGrant grant{.player = player,
                         .credentials = net::IssuePlayer(kId, player, net::Generation(1), key_),
                         .map = map,
                         .regions = {},
                         .scene_hash = scene_hash_,
                         .tick_rate_hz = kTickRate,
                         .snapshot_rate_hz = kSnapshotRate,
                         .expected_players = 0};
    for (std::size_t i = 0; i < regions.size(); ++i) {
      grant.regions.push_back({map.regions()[i].id, "127.0.0.1", regions[i]->port(), regions[i]->incarnation()});
    }
    return net::EncodeJoinGrant(grant);
  }
  void BecomeAnother(std::size_t index) { regions[index]->BecomeAnother(key_, kId); }
  void Service() {
    for (const auto& region : regions) region->Service();
  }

  grpc::Status JoinInstance(grpc::ServerContext*, const v1::JoinInstanceRequest* request,
                            v1::JoinInstanceResponse* response) override {
    if (request->instance_id() != kId) return {grpc::StatusCode::NOT_FOUND, "instance_id: no instance"};
    if (full) return {grpc::StatusCode::RESOURCE_EXHAUSTED, "full: 64 players"};
    if (!request->ticket().empty() && request->ticket() != kTicket) {
      return {grpc::StatusCode::UNAUTHENTICATED, "ticket: is not signed by issuer game"};
    }
    PlayerNumber player;
    net::Generation generation(1);
    if (request->viewer()) {
      player = PlayerNumber(kFirstViewer + 5);
    } else if (request->credential().empty()) {
      player = PlayerNumber(++players_);
    } else {
      const std::optional<net::PlayerCredential> who = Proves(*request);
      if (!who) return {grpc::StatusCode::UNAUTHENTICATED, "credential"};
      player = who->player;
      generation = net::Generation(1 + ++returned_);
    }
    const net::Credentials credentials =
        net::IssuePlayer(kId, player, generation, wrong_key ? net::SigningKey::Make() : key_);
    const net::VerificationKey& instance_key = key_.verification_key();
    const net::Seed seed = credentials.key.seed();
    response->set_player(player.value());
    response->set_credential(std::string(credentials.statement.begin(), credentials.statement.end()));
    response->set_credential_key(seed.data(), seed.size());
    response->set_instance_key(instance_key.data(), instance_key.size() - (short_instance_key ? 1 : 0));
    *response->mutable_map() = ToProto(map);
    const std::lock_guard lock(regions_change_);
    for (std::size_t i = 0; i < regions.size(); ++i) {
      v1::RegionAddress& address_of = *response->add_regions();
      address_of.set_region(map.regions()[i].id.value());
      address_of.set_host("127.0.0.1");
      address_of.set_game_port(regions[i]->port());
    }
    if (forget_a_region) response->mutable_regions()->RemoveLast();
    response->set_scene_hash(wrong_hash ? std::string(64, '0') : scene_hash_);
    response->set_tick_rate_hz(kTickRate);
    response->set_snapshot_rate_hz(kSnapshotRate);
    return grpc::Status::OK;
  }
  grpc::Status GetScene(grpc::ServerContext*, const v1::GetSceneRequest*, v1::GetSceneResponse* response) override {
    ++scenes_fetched;
    response->set_scene(scene_bytes_);
    return grpc::Status::OK;
  }
  grpc::Status LeaveInstance(grpc::ServerContext*, const v1::LeaveInstanceRequest* request,
                             v1::LeaveInstanceResponse*) override {
    if (!Proves(*request)) return {grpc::StatusCode::UNAUTHENTICATED, "credential"};
    ++left;
    return grpc::Status::OK;
  }

  std::shared_ptr<const Scene> scene;
  PartitionMap map;
  std::vector<std::unique_ptr<FakeRegion>> regions;
  std::string address;
  FakeInstanceList list;
  // Set before Join, read after: gRPC's threads run in between.
  std::atomic<bool> full = false, wrong_key = false, short_instance_key = false, wrong_hash = false,
                    forget_a_region = false;
  std::atomic<int> scenes_fetched = 0, left = 0;

 private:
  // The player whose credential and key a request shows.
  template <class Request>
  std::optional<net::PlayerCredential> Proves(const Request& request) const {
    const std::string& bytes = request.credential();
    const auto credential = net::ReadPlayerCredential(
        {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, kId, key_.verification_key());
    const auto key = net::SigningKey::FromSeed(request.credential_key(), "credential_key");
    const bool proves = credential.ok() && key.ok() && key->verification_key() == credential->key;
    return proves ? std::optional(*credential) : std::nullopt;
  }

  const net::SigningKey key_ = net::SigningKey::Make();
  std::string scene_bytes_, scene_hash_;
  std::atomic<std::uint32_t> players_ = 0, returned_ = 0;
  std::mutex regions_change_;     // a client may ask for another grant while the test ends and starts regions
  host::TemporaryFolder folder_;  // holds the socket
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace tessera::client
