// Games that fail, for tests: each of these names makes a library of its own.
#include <stdexcept>
#include <string>

#include "tessera/game.hpp"

#if defined(BAD_MODULE_NO_ENTRY)

extern "C" __attribute__((visibility("default"))) const tessera_game_module* another_function() { return nullptr; }

#elif defined(BAD_MODULE_OTHER_ABI)

extern "C" __attribute__((visibility("default"))) const tessera_game_module* tessera_game_module_1() {
  static const tessera_game_module module = {sizeof module, TESSERA_GAME_ABI + 7, nullptr, nullptr, nullptr, nullptr,
                                             nullptr};
  return &module;
}

#elif defined(BAD_MODULE_MOVEMENT_ALONE)

static const tessera_movement hover = {
    sizeof hover, TESSERA_MOVEMENT_ABI, "hover", 1, TESSERA_MAX_MOVEMENT_STATE + 1, nullptr, nullptr, nullptr};

TESSERA_MOVEMENT_MODULE(&hover)

#else

using namespace tessera::native;

#if defined(BAD_MODULE_MOVEMENT)

// Made for an interface of movements that is to come.
const tessera_movement movement = {sizeof movement, TESSERA_MOVEMENT_ABI + 7, "hover", 1, 0, nullptr, nullptr, nullptr};

TESSERA_MOVING_GAME_MODULE(game, &movement) {
  game.on_tick([](World&) {});
}

#elif defined(BAD_MODULE_CRASHES)

// The compiler must not see that it is none.
volatile int* volatile nowhere = nullptr;

TESSERA_GAME_MODULE(game) {
  game.kind("crate").on_contact([](World&, Body, Body) { *nowhere = 1; });
  game.on_tick([](World& world) {
#if defined(BAD_MODULE_LATE)
    if (world.tick() >= 400) *nowhere = 1;
#else
    if (world.tick() == 10) *nowhere = 1;
#endif
  });
}

#elif defined(BAD_MODULE_NO_LOAD)

TESSERA_GAME_MODULE(game) {
  if (game.find(kOnTick, nullptr) == nullptr) throw std::runtime_error("the game does not want to");
}

#else

TESSERA_GAME_MODULE(game) {
  game.kind("crate")
      .on_contact([](World&, Body self, Body) {
        self.set("health", 1);
        throw std::runtime_error("nobody caught this");
      })
      .on_contact_ended([](World&, Body self, Body) {
        self.set("health", 2);
        throw 7;
      })
      .on_entered([](World&, Body self, Body) { self.set("mana", 1); })
      .on_left([](World& world, Body self, Body) {
        self.set("health", 3);
        for (;;) world.charge(1000);
      });
  game.kind("ball")
      .on_contact([](World& world, Body self, Body other) {
        const Values options{{"velocity", Vector{1, 2, 3}}, {"expire_after", 5}};
        const Body spawned = world.spawn("train", {1, 0, 2}, options);
        if (*spawned.member(1) != spawned || !spawned.member(3) || spawned.member(4)) throw Error("member");
        if (self.kind() != "ball" || self.mass() != 2 || !self.is_own() || !other.is_here()) throw Error("reads");
        if (self.real("heat") != 0.5 || self.text("name") != "none" || self.flag("on")) throw Error("properties");
        self.set("name", "changed");
        self.set("heat", 2);
        self.set("on", true);
        const auto timer = self.after(3, "later", {{"to", other.id()}, {"about", "text"}, {"by", 1.5}});
        if (!self.cancel(timer) || self.cancel(timer)) throw Error("cancel");
        self.after(1, "then", {{"z", 1}, {"a", Vector{1, 2, 3}}});
        self.impulse({0, 4, 0});
      })
      .on_timer([](World& world, Body, const std::string& name, const Values& values) {
        world.log(name + " " + std::to_string(values["z"].whole()) +
                  (values["a"].vector().y == 2 && values["b"].nothing() ? " all is well" : " something is wrong"));
      });
}

#endif
#endif
