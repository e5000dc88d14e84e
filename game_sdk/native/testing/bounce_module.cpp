// A game for tests: a ball counts what it hits, and is thrown up again.
#include "tessera/game.hpp"

using namespace tessera::native;

TESSERA_GAME_MODULE(game) {
  game.kind("ball").on_contact([](World&, Body self, Body) {
    self.set("hits", self.whole("hits") + 1);
    self.impulse({0, 3, 0});
  });
}
