// Inside of Client. Not for others. Its parts own their data; its 44 methods are one for each thing that a poll does
// and for each kind of message, and lead from part to part.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client_sdk/bodies_on_paths.h"
#include "client_sdk/client.h"
#include "client_sdk/client_endpoint.h"
#include "client_sdk/client_figures.h"
#include "client_sdk/client_progress.h"
#include "client_sdk/connected_regions.h"
#include "client_sdk/game_talk.h"
#include "client_sdk/input_maker.h"
#include "client_sdk/live_recording.h"
#include "client_sdk/own_body.h"
#include "client_sdk/pair_book.h"
#include "client_sdk/playback.h"
#include "client_sdk/prediction.h"
#include "client_sdk/scene_delivery.h"
#include "client_sdk/session.h"
#include "client_sdk/tile_view.h"
#include "client_sdk/world_properties.h"
#include "client_sdk/world_time.h"
#include "client_sdk/world_view.h"
#include "core/replication/region_message.h"

namespace tessera::client {

// Datagrams that a poll receives at most, and for each connection as many again. Far more than a region sends between
// two polls; after a pause the rest waits for the polls that follow.
inline constexpr std::size_t kDatagramsAPoll = 128;

// The terms that a client goes by, however it joined.
struct Client::Settings {
  std::string instance_id{};
  std::chrono::milliseconds deadline{10'000};
  std::string bind_address = "0.0.0.0";
  NetworkConditions network{};
  bool predict = false;
  bool returning = false;  // an older process of the player may be there: it is not let go of for a fault here
  bool by_grant = false;   // nobody but its caller can get it another
  std::string scene_cache_dir{};
  std::vector<std::uint8_t> packed_scene{};  // from a caller that has it
  LeaveCall leave{};                         // null: leaving closes the connections, and that is all
};

// Routes between the parts of a client, each of which owns what it knows. A poll (client.cpp) goes through them so:
//
//   datagrams -> connections -> messages -> scene and tiles, world, time, talk        (Receive)
//   world, inputs -> what is predicted                                                (Correct)
//   scene and tiles: what is here is read, what is missing is asked for               (Read..., AskFor...)
//   own body, map -> connections; all of it -> how far the client is                  (Follow, CheckProgress)
//   steering, time -> inputs, commands -> connections                                 (Make..., Send...)
//
// The parts are pure but for the network, the tiles, the scene and the recordings, which have sockets and files. They
// know nothing of each other but by what they are given; their events go into one list, in the order of the steps.
struct Client::Impl {
  // Without a scene in the session, the regions are asked for it.
  Impl(Settings settings_in, Session session_in, std::unique_ptr<net::Endpoint> endpoint);

  // Receives (client_receive.cpp).
  void Receive(TimePoint now);
  void OnEvent(TimePoint now, RegionConnection& connection, const net::Event& event);
  void OnDisconnected(TimePoint now, RegionConnection& connection);
  void OnLost(TimePoint now, RegionId region);
  void OnControl(TimePoint now, RegionConnection& connection, const net::Bytes& bytes);
  void On(TimePoint now, RegionConnection& connection, const replication::Welcome& welcome);
  void On(TimePoint now, RegionConnection& connection, const replication::RegionRefusal& refusal);
  void On(TimePoint now, RegionConnection& connection, const replication::Started& started_now);
  void On(TimePoint now, RegionConnection& connection, const replication::MapNews& news);
  void On(TimePoint now, RegionConnection& connection, const replication::InputRefusal& refusal);
  void On(TimePoint now, RegionConnection& connection, const replication::Stopping& stopping);
  void On(TimePoint now, RegionConnection& connection, const replication::PairNews& news);
  void On(TimePoint now, RegionConnection& connection, const replication::NewsOfPlayer& news);
  void On(TimePoint now, RegionConnection& connection, const replication::EndOfSession& ended);
  void On(TimePoint now, RegionConnection& connection, const replication::CommandRefusal& refusal);
  void On(TimePoint now, RegionConnection& connection, const replication::ClockNews& news);
  void On(TimePoint now, RegionConnection& connection, const replication::NewsOfWorld& news);
  void OnSnapshot(TimePoint now, RegionConnection& connection, const net::Bytes& bytes);
  void OnMovement(RegionConnection& connection, const net::Bytes& bytes);
  void OnDialRefused(TimePoint now, RegionConnection& connection, const net::Refusal& refusal);
  void SettlePairs(TimePoint now);

  // Gets the scene from the regions (client_scene.cpp).
  void OnSceneMessage(TimePoint now, RegionConnection& connection, const net::Bytes& bytes);
  void AskForScene(TimePoint now);
  void ReadScene(TimePoint now);
  void EnterScene(TimePoint now, std::shared_ptr<const Scene> scene, std::shared_ptr<const LevelIndex> index = nullptr);

  // Gets the tiles of a large level from the regions (client_tiles.cpp).
  void ReadTiles(TimePoint now);
  void AskForTiles(TimePoint now);

  // Chooses the regions to be connected to (client_follow.cpp).
  ConnectedRegions::Interest Interest() const;
  void Follow(TimePoint now);
  void CheckProgress(TimePoint now);
  void Renew(Session fresh);
  void StartOver(TimePoint now);
  void End(absl::Status why, std::string detail, bool needs_new_grant = false);

  // Records, and plays back (client_recording.cpp).
  void RegionChanged(TimePoint now, RegionId region, RegionEntry::Change change);
  static std::unique_ptr<Impl> Playing(Playback from);
  void PlayBack(TimePoint now);
  void PlayStep(Replay::Step step);

  // Makes and sends inputs (client_input.cpp).
  void MakeInputs(TimePoint now);
  void NoteApplied(TimePoint now, const RegionConnection& connection, const replication::ReceivedSnapshot& snapshot);
  void Correct();
  void SendInputs(TimePoint now);

  // Talks with the game (client_talk.cpp).
  void SendCommands(TimePoint now);

  ClientStats Stats() const;

  Settings settings;
  Session session;  // the map and the regions in it have gone to `regions`
  ClientEndpoint network;
  ConnectedRegions regions;
  ClientProgress progress;
  SceneDelivery delivery;
  TileView tiles;

  OwnBody own;
  InputMaker inputs;
  WorldView world;
  PairBook pairs;
  WorldTime time;
  Prediction prediction;
  BodiesOnPaths on_paths;
  GameTalk talk;
  WorldProperties properties;

  LiveRecording recording;
  std::optional<Playback> playback;  // instead of regions
  ClientFigures figures;

  std::vector<ClientEvent> events;              // the result of the Poll under way
  std::optional<TimePoint> last_poll;           // the beginning of the Poll under way, or of the last
  std::chrono::nanoseconds since_last_poll{0};  // between that and the one before
  bool behind = false;                          // the last poll did not take all that had come
  std::vector<net::Event> kept;                 // datagrams that have come, and the next poll reads
};

}  // namespace tessera::client
