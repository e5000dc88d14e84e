// Balls spring from a fountain, count what they hit, and go after a while. fountain.lua is the same game in Lua.
#include <string>

#include "tessera/game.hpp"

using namespace tessera::native;

TESSERA_GAME_MODULE(game) {
  game.on_tick([](World& world) {
    if (world.tick() % 10 != 0) return;
    // The order in which random numbers are drawn is that of the Lua game.
    const double x = world.random() * 20 - 10, z = world.random() * 20 - 10;
    const double speed_x = world.random() * 8 - 4, speed_z = world.random() * 8 - 4;
    Body ball = world.spawn("ball", {x, 2, z}, {{"velocity", Vector{speed_x, 0, speed_z}}});
    ball.after(90, "go", {{"lift", 2.5}});
  });

  game.kind("ball")
      .on_contact([](World&, Body self, Body) { self.set("hits", self.whole("hits") + 1); })
      .on_timer([](World&, Body self, const std::string& name, const Values& values) {
        if (self.whole("hits") == 0) return self.remove();
        self.set("hits", 0);
        self.impulse({0, values["lift"].real() * self.mass(), 0});
        self.after(60, name, values);
      });
}
