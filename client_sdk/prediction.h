// Prediction: the part of the world that a client shows ahead of the others: the own body, with what it touches, and
// what the player has thrown. A client that does not predict has one, too, which changes nothing.
//
//   prediction.Begin(scene, player, index);                 // the scene is here
//   prediction.Add(input);                                  // the player's, one a tick
//   prediction.Heard(now, correction);                      // the own body's region sent a snapshot
//   prediction.Correct(own, world, budget, events);         // once a poll
//   prediction.Show(now, phase, clock, world, shown);       // once a frame
//
// Promise: nothing counts as predicted of which its region has not spoken for long.
// Thread rule: one thread at a time; time comes in.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/own_body.h"
#include "client_sdk/predictor.h"
#include "client_sdk/work_budget.h"
#include "client_sdk/world_view.h"

namespace tessera::client {

class Prediction {
 public:
  // From now on the own body is predicted. INVALID_ARGUMENT where the program's movement does not fit the scene, after
  // which there is none.
  absl::Status Begin(const std::shared_ptr<const Scene>& scene, PlayerNumber player,
                     std::shared_ptr<const LevelIndex> index);
  // As Client::SetMovement. Before Begin the movement waits.
  absl::Status SetMovement(const tessera_movement* movement);
  bool on() const { return predictor_.has_value(); }
  bool running() const { return predictor_ && predictor_->running(); }

  // As Predictor; without one nothing, and every body may be the own one.
  bool Knows(BodyId own) const { return !predictor_ || predictor_->Knows(own); }
  void Follow(BodyId own, const PlayerLimits& limits, const std::vector<game::JointOfBody>& joints);
  // Names the movement of the game that the program does not have, once; empty: nothing new.
  std::string TakeMovement(const replication::MovementNews& news);
  void AddTile(std::uint32_t tile, std::shared_ptr<const Tile> content);
  void DropTile(std::uint32_t tile);
  void Add(const PlayerInput& input);
  bool NeedsInputs() const { return predictor_ && predictor_->NeedsInputs(); }

  // The own body's region has spoken. `correct_to`: by then it had applied this input, and its state is here.
  void Heard(TimePoint now, std::optional<std::pair<Tick, std::uint32_t>> correct_to);
  // Corrects what is predicted by what has come; the events say so.
  void Correct(const OwnBody& own, const WorldView& world, WorkBudget& budget, std::vector<ClientEvent>& events);
  // Gives up what was thrown and has not come in time. The events say what has become of all that was.
  void ExpireThrown(TimePoint now, const WorldClock& clock, const WorldView& world, std::vector<ClientEvent>& events);
  // The world starts over: nothing is predicted until the own body has been heard of again.
  void Forget();

  std::size_t thrown() const { return predictor_ ? predictor_->thrown() : 0; }
  // As Predictor::Throw. Requires running().
  BodyId Throw(const SpawnAsk& ask, std::size_t prefab, SpawnClaim claim, std::uint32_t input, TimePoint until);
  // Nothing that was thrown is shown any more.
  void DropThrown(const WorldView& world, std::vector<ClientEvent>& events);

  // `shown`: ascending by id, before and after. `phase`: as InputClock has it.
  void Show(TimePoint now, double phase, const WorldClock& clock, const WorldView& world,
            std::vector<ShownBody>& shown);
  void AddTo(ClientStats& stats) const;

 private:
  void ReportThrown(const WorldView& world, std::vector<ClientEvent>& events);
  void ShowThrown(std::vector<ShownBody> thrown, const WorldView& world, std::vector<ShownBody>& shown) const;

  std::optional<Predictor> predictor_;
  const tessera_movement* movement_ = nullptr;  // the program's, until Begin
  std::optional<std::pair<Tick, std::uint32_t>> correct_to_;
  TimePoint heard_at_{};  // when the newest report of the own body's region came
};

}  // namespace tessera::client
