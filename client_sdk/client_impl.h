// Inside of Client. Not for others.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client_sdk/client.h"
#include "client_sdk/input_clock.h"
#include "client_sdk/input_queue.h"
#include "client_sdk/pair_book.h"
#include "client_sdk/playout_clock.h"
#include "client_sdk/predictor.h"
#include "client_sdk/recorder.h"
#include "client_sdk/region_link.h"
#include "client_sdk/replay.h"
#include "client_sdk/session.h"
#include "client_sdk/wire.h"
#include "client_sdk/world_view.h"
#include "tessera/v1/game.pb.h"

namespace tessera::client {

struct Client::Impl {
  Impl(const JoinOptions& options_in, Session session_in, std::unique_ptr<net::Endpoint> endpoint);

  // What has come (client_receive.cpp).
  void Receive(TimePoint now);
  void OnEvent(TimePoint now, RegionLink& link, const net::Event& event);
  void OnDisconnected(TimePoint now, RegionLink& link);
  void OnControl(TimePoint now, RegionLink& link, const net::Bytes& bytes);
  void OnWelcome(TimePoint now, RegionLink& link, const v1::RegionWelcome& welcome);
  void OnRefusal(TimePoint now, RegionLink& link, const v1::RegionRefusal& refusal);
  void OnStopping(TimePoint now, RegionLink& link, const std::string& why);
  void OnSnapshot(TimePoint now, RegionLink& link, const net::Bytes& bytes);
  void OnDialRefused(TimePoint now, RegionLink& link, const net::Refusal& refusal);
  void OnRenewedToken(RegionLink& link, const v1::RenewedToken& renewed);
  void OnPairEvents(TimePoint now, RegionLink& link, const v1::PairEvents& told);
  bool IsStatic(BodyId body) const;
  void SettlePairs(TimePoint now);
  void Start();
  RegionLink* LinkOf(net::PeerHandle peer);
  bool AllWelcomed() const;
  bool IsWelcomed(RegionId region) const;

  // Which regions to be connected to (client_follow.cpp).
  void AdoptMap(RegionLink& from, const v1::PartitionMap& map);
  void AdoptEndpoints(RegionLink& from, const google::protobuf::RepeatedPtrField<v1::RegionEndpoint>& endpoints);
  void Follow(TimePoint now);
  void DropGone(TimePoint now);
  void DropFar(TimePoint now);
  void MoveLinks(TimePoint now);
  void AddMissing();
  bool Near(RegionId region, double more_m) const;
  bool Touches(RegionId region, double more_m) const;
  std::optional<Vec3d> OwnPosition() const;
  std::vector<RegionLink>::iterator LetGo(std::vector<RegionLink>::iterator link);
  void CheckProgress(TimePoint now);
  void End(absl::Status why, std::string detail);

  // What is recorded, and played back (client_recording.cpp).
  void RegionChanged(TimePoint now, RegionId region, RegionEntry::Change change);
  void RecordAllKnown(TimePoint now);
  void RecordEvents(TimePoint now);
  absl::Status EndRecording();
  void PlayBack(TimePoint now);
  void PlayStep(Replay::Step step);

  // What goes out (client_input.cpp).
  void MakeInputs(TimePoint now);
  void NoteApplied(TimePoint now, const RegionLink& link, const replication::ReceivedSnapshot& snapshot);
  void Correct();
  void ShowPredicted(TimePoint now, std::vector<ShownBody>& shown);
  void SendInputs(TimePoint now);
  void Push(BodyId body, Vec3f force_n, Vec3f torque_nm);

  void Sent(std::size_t bytes) { bytes_out += bytes; }
  void MeasureRates(TimePoint now);
  ClientStats Stats() const;

  struct Traffic {
    TimePoint time;
    std::uint64_t in = 0, out = 0;
  };

  JoinOptions options;
  Session session;
  Wire wire;
  std::vector<RegionLink> links;                 // ascending by region
  std::map<RegionId, RegionEndpoint> endpoints;  // the newest known of each
  bool follow_due = false;                       // map or endpoints have changed
  double interest_radius_m;                      // 0: all of the world
  ClientState state = ClientState::kJoining;
  bool started = false;
  bool searching = false;  // no region that is near answers: all of the map are asked
  absl::Status reason;
  std::vector<ClientEvent> events;  // of the Poll under way

  WorldView world;
  PairBook pairs;
  PlayoutClock playout;
  Tick newest_tick;
  std::uint32_t last_applied_input = 0;

  Vec3f steering_force_n, steering_torque_nm;
  std::uint32_t next_input = 1;
  InputQueue inputs;
  InputClock input_clock;
  // What the own body's region told last: at `tick` it had applied `input`.
  struct Applied {
    Tick tick;
    std::uint32_t input = 0;
  };
  std::optional<Applied> applied, correct_to;
  std::optional<Predictor> predictor;

  std::optional<Recorder> recorder;
  std::optional<Replay> replay;  // instead of regions

  std::optional<TimePoint> joined_by, last_poll, silent_since;
  std::uint64_t bytes_in = 0, bytes_out = 0, full_records = 0, delta_records = 0, inputs_refused = 0;
  RegionStats let_go;           // sums over links that are no more
  std::deque<Traffic> traffic;  // over the last second
  DurationStats frame_time, network_time, update_time;
};

}  // namespace tessera::client
