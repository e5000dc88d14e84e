// For tests: a client made of an endpoint and nothing else, so that each message can be wrong on purpose.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/replication/input.h"
#include "core/replication/region_figures.h"
#include "core/replication/scene_transfer.h"
#include "core/replication/snapshot.h"
#include "net/credential.h"
#include "net/endpoint.h"
#include "tessera/v1/game.pb.h"

namespace tessera::worker {

net::Credentials CredentialsFor(std::uint32_t player, std::uint64_t generation = 1);  // for the standalone instance

class TestClient {
 public:
  explicit TestClient(const Aabb& world_bounds);

  // To a region's game port. `Connect` waits until it is let in or refused: true if it is in.
  void Dial(std::uint16_t port, RegionId region, const net::Credentials& credentials);
  bool Connect(std::uint16_t port, RegionId region, const net::Credentials& credentials);
  void SendDatagram(std::span<const std::uint8_t> bytes);
  // With the acknowledgement of what has come so far.
  void SendInput(const PlayerInput& input);
  void Acknowledge();
  void AskForScene(replication::SceneRequest::Want want, const replication::Digest& hash = {});
  // For what has not come of these tiles.
  void AskForTiles(const std::vector<std::uint32_t>& wanted);

  // Takes what has come, answering snapshots; waits a little for the first.
  void Service();
  bool Until(const std::function<bool()>& done);

  // The newest of what came.
  std::optional<v1::RegionWelcome> welcome;
  std::optional<v1::RegionRefusal> refusal;
  std::optional<v1::InputRefused> input_refused;
  std::optional<v1::CommandRefused> command_refused;
  std::optional<v1::RegionStopping> stopping;
  bool started = false, connected = false, disconnected = false;
  std::map<BodyId, BodyState> bodies;                      // as received; departed ones are not in it
  std::set<BodyId> ever_seen;                              // those that any snapshot had
  std::map<BodyId, std::vector<std::uint8_t>> properties;  // the newest that came, as PropertySet::Encode wrote them
  Tick tick;
  std::optional<replication::RegionFigures> figures;
  std::uint32_t last_input = 0;
  // The part of the packed scene that came, from its beginning or from where the test says that it was; and its size.
  std::vector<std::uint8_t> scene_bytes;
  std::uint64_t scene_total = 0;
  std::string scene_refused;
  std::map<std::uint32_t, std::vector<std::uint8_t>> tiles;  // as much of each as has come
  std::uint32_t full_records = 0, records = 0;               // since the start

 private:
  void Handle(const net::Event& event);
  void ReadSnapshot(const net::Bytes& bytes);
  void ReadScene(const net::Bytes& bytes);

  std::unique_ptr<net::Endpoint> endpoint_;
  net::PeerHandle peer_;
  replication::SnapshotReceiver receiver_;
  std::uint32_t snapshots_ = 0, tile_requests_ = 0;
};

// Services all clients until `done`; false when it takes longer than kPatience.
bool Until(std::initializer_list<TestClient*> clients, const std::function<bool()>& done);

}  // namespace tessera::worker
