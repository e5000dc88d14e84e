// Players who drive: the module of a game that has nothing of its own but how a car moves.
#include "car_movement.h"
#include "tessera/game.hpp"

TESSERA_MOVING_GAME_MODULE(game, &car_movement) {
  game.on_tick([](tessera::native::World& world) {
    if (world.tick() == 1) world.log("drive: forward and back, left and right, and button 0 brakes");
  });
}
