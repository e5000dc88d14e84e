// OwnBody: who a client is in the world: the body that its inputs move, and where its player looks from.
//
// That body is the player's, or another one that the game has given it while the player's stands aside. Until it is in
// sight, a place to look from stands in. A viewer has neither.
// Pure. Thread rule: one thread at a time.
#pragma once

#include <optional>

#include "client_sdk/world_view.h"
#include "core/world/ids.h"
#include "core/world/math.h"
#include "core/world/scene.h"
#include "core/world/viewer_number.h"

namespace tessera::client {

class OwnBody {
 public:
  explicit OwnBody(PlayerNumber player) : player_(player) {}

  PlayerNumber player() const { return player_; }  // or a viewer's number
  bool watches() const { return IsViewer(player_); }
  BodyId player_body() const { return PlayerBodyId(player_); }
  // The body that the inputs move.
  BodyId id() const { return controlled_ == BodyId() ? player_body() : controlled_; }
  // The body that an input for `asked` moves.
  BodyId MovedBy(BodyId asked) const { return asked == player_body() ? id() : asked; }
  // Where the player looks from while its body is out of the world; nothing while it plays.
  const std::optional<Vec3d>& spectator_view() const { return spectator_view_; }
  // Whether a function of the game moves it, as far as its region has said.
  bool MovedByGame() const { return moved_by_game_ == id(); }

  // A viewer goes on under another number.
  void Renumber(PlayerNumber viewer) { player_ = viewer; }
  // The inputs move this body from now on; 0: the player's.
  void Control(BodyId body) { controlled_ = body; }
  void LookFrom(std::optional<Vec3d> view) { spectator_view_ = view; }
  void NoteMovedByGame(BodyId body) { moved_by_game_ = body; }

  // Where it is; out of sight, where the player looks from, or where the body is going to be.
  std::optional<Vec3d> Position(const WorldView& world, const Scene& scene) const;

 private:
  PlayerNumber player_;
  BodyId controlled_;                    // another body, which the inputs move; 0: none
  BodyId moved_by_game_;                 // a body of the player's that a function of the game has moved; 0: none
  std::optional<Vec3d> spectator_view_;  // while the own body is out of the world
};

}  // namespace tessera::client
