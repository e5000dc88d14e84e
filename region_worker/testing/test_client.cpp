#include "region_worker/testing/test_client.h"

#include <gtest/gtest.h>

#include "net/protocol.h"
#include "region_worker/standalone.h"
#include "region_worker/testing/worker_process.h"

namespace tessera::worker {

net::Credentials CredentialsFor(std::uint32_t player, std::uint64_t generation) {
  return net::IssuePlayer(kStandaloneInstanceId, PlayerNumber(player), net::Generation(generation), StandaloneKey());
}

TestClient::TestClient(const Aabb& world_bounds) : receiver_(world_bounds, replication::SnapshotSettings{}) {
  auto endpoint = net::Endpoint::Create({.bind_address = "127.0.0.1"});
  EXPECT_TRUE(endpoint.ok()) << endpoint.status();
  endpoint_ = *std::move(endpoint);
}

void TestClient::Dial(std::uint16_t port, RegionId region, const net::Credentials& credentials) {
  const auto peer = endpoint_->Connect("127.0.0.1", port, region, Incarnation(), credentials);
  ASSERT_TRUE(peer.ok()) << peer.status();
  peer_ = *peer;
}

bool TestClient::Connect(std::uint16_t port, RegionId region, const net::Credentials& credentials) {
  Dial(port, region, credentials);
  return Until([&] { return connected || disconnected; }) && connected;
}

void TestClient::SendDatagram(std::span<const std::uint8_t> bytes) {
  EXPECT_TRUE(endpoint_->Send(peer_, net::Delivery::kUnsequenced, bytes).ok());
}

void TestClient::SendInput(const PlayerInput& input) {
  SendDatagram(replication::EncodeInput({.ack = receiver_.WriteAck(), .inputs = {input}}));
}

void TestClient::Acknowledge() { SendDatagram(replication::EncodeInput({.ack = receiver_.WriteAck(), .inputs = {}})); }

void TestClient::AskForScene(replication::SceneRequest::Want want, const replication::Digest& hash) {
  SendDatagram(replication::EncodeSceneRequest({.want = want, .scene_hash = hash, .offset = scene_bytes.size()}));
}

void TestClient::AskForTiles(const std::vector<std::uint32_t>& wanted) {
  replication::TileRequest request{.number = ++tile_requests_, .scene_hash = {}, .wishes = {}};
  for (const std::uint32_t tile : wanted) request.wishes.push_back({tile, tiles[tile].size()});
  SendDatagram(replication::EncodeTileRequest(request));
}

void TestClient::Service() {
  const std::uint32_t before = snapshots_;
  for (const net::Event& event : endpoint_->Service(std::chrono::milliseconds(2))) Handle(event);
  // The end of the connection may have come right behind a snapshot.
  if (snapshots_ != before && !disconnected) Acknowledge();
}

bool TestClient::Until(const std::function<bool()>& done) { return worker::Until({this}, done); }

bool Until(std::initializer_list<TestClient*> clients, const std::function<bool()>& done) {
  for (const auto limit = std::chrono::steady_clock::now() + kPatience; std::chrono::steady_clock::now() < limit;) {
    if (done()) return true;
    for (TestClient* client : clients) client->Service();
  }
  return done();
}

void TestClient::Handle(const net::Event& event) {
  if (event.kind == net::Event::Kind::kConnected) connected = true;
  if (event.kind == net::Event::Kind::kDisconnected) disconnected = true;
  if (event.refusal) {
    refusal.emplace().set_reason(static_cast<v1::RefusalReason>(event.refusal->reason));
    refusal->set_detail(event.refusal->detail);
  }
  if (event.kind != net::Event::Kind::kMessage) return;
  if (event.delivery == net::Delivery::kUnsequenced) return ReadSnapshot(event.bytes);
  if (replication::IsSceneMessage(event.bytes)) return ReadScene(event.bytes);
  v1::RegionControl control;
  ASSERT_TRUE(control.ParseFromArray(event.bytes.data(), static_cast<int>(event.bytes.size())));
  if (control.has_welcome()) welcome = control.welcome();
  if (control.has_refusal()) refusal = control.refusal();
  if (control.has_input_refused()) input_refused = control.input_refused();
  if (control.has_command_refused()) command_refused = control.command_refused();
  if (control.has_stopping()) stopping = control.stopping();
  started = started || control.has_started() || (control.has_welcome() && control.welcome().started());
}

void TestClient::ReadScene(const net::Bytes& bytes) {
  const auto message = replication::DecodeSceneMessage(bytes);
  ASSERT_TRUE(message.ok()) << message.status();
  if (const auto* refused = std::get_if<replication::SceneRefusal>(&*message)) {
    scene_refused = refused->why;
    return;
  }
  if (const auto* part = std::get_if<replication::TileChunk>(&*message)) {
    std::vector<std::uint8_t>& tile = tiles[part->tile];
    ASSERT_EQ(part->offset, tile.size());
    tile.insert(tile.end(), part->bytes.begin(), part->bytes.end());
    return;
  }
  const auto& chunk = std::get<replication::SceneChunk>(*message);
  ASSERT_EQ(chunk.offset, scene_bytes.size());
  scene_bytes.insert(scene_bytes.end(), chunk.bytes.begin(), chunk.bytes.end());
  scene_total = chunk.total_bytes;
}

void TestClient::ReadSnapshot(const net::Bytes& bytes) {
  if (const auto read = replication::DecodeRegionFigures(bytes); read.ok()) figures = *read;
  const absl::StatusOr<replication::ReceivedSnapshot> snapshot = receiver_.Read(bytes);
  if (!snapshot.ok()) return;  // lost baselines and doubles are part of the game
  tick = std::max(tick, snapshot->tick);
  last_input = snapshot->last_input;
  for (const replication::BodyRecord& body : snapshot->bodies) {
    bodies[body.id] = body.state;
    ever_seen.insert(body.id);
    if (body.properties != nullptr) properties[body.id] = *body.properties;
  }
  for (const replication::DepartureRecord& departure : snapshot->departures) bodies.erase(departure.id);
  full_records += snapshot->full_records;
  records += static_cast<std::uint32_t>(snapshot->bodies.size());
  ++snapshots_;
}

}  // namespace tessera::worker
