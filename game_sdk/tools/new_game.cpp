#include "game_sdk/tools/new_game.h"

#include "absl/strings/str_replace.h"
#include "game_sdk/tools/reference.h"

namespace tessera::game {
namespace {

constexpr char kScene[] = R"json({
  "name": "NAME",
  "bounds": { "min": { "x": -20, "y": -5, "z": -20 }, "max": { "x": 20, "y": 50, "z": 20 } },
  "properties": [
    { "name": "score", "number": 0 }
  ],
  "instance_properties": [
    { "name": "goals", "number": 0 }
  ],
  "prefabs": [
    { "name": "spark", "bodies": [ { "kind": "spark", "mass": 0.1, "shape": { "sphere": { "radius": 0.1 } } } ] }
  ],
  "bodies": [
    {
      "id": 1, "name": "ground", "motion": "MOTION_STATIC",
      "shape": { "plane": { "normal": { "y": 1 } } }
    },
    {
      "id": 2, "name": "gate", "kind": "gate", "motion": "MOTION_STATIC", "trigger": true,
      "shape": { "box": { "half_extents": { "x": 0.2, "y": 2, "z": 2 } } },
      "pose": { "position": { "x": 3, "y": 2, "z": 1 } }
    },
    {
      "id": 3, "name": "ball", "kind": "ball", "mass": 1,
      "shape": { "sphere": { "radius": 0.5 } },
      "pose": { "position": { "x": -4, "y": 0.5, "z": 1 } },
      "linear_velocity": { "x": 6 }
    }
  ],
  "player": {
    "body": {
      "name": "player", "mass": 80, "never_sleeps": true,
      "shape": { "capsule": { "radius": 0.4, "half_height": 0.5 } }
    },
    "spawn_points": [ { "y": 0.9, "z": -5 } ],
    "max_force": 800,
    "max_speed": 6
  }
}
)json";

constexpr char kGame[] = R"lua(-- A ball that rolls through the gate scores, and jumps for joy a second later.
-- What is to be remembered stands in properties, which scene.json declares, and in timers.

local JUMP = vec(0, 3, 0) -- N s

kinds.gate = {
  on_entered = function(self, other)
    if other:kind() ~= "ball" then return end
    other.score = other.score + 1
    other:after(60, "jump", { gate = self })
  end,
}

kinds.ball = {
  on_timer = function(self, name, values)
    if name ~= "jump" then return end
    self:impulse(JUMP)
    print("score", self.score, "by", values.gate)
  end,
}
)lua";

constexpr char kTest[] =
    R"lua(-- Each test runs in one region and in several, in fresh Lua states, and while regions die.

test("a ball that rolls through the gate scores once", function(t)
  local ball = t:body("ball")
  t:expect_equal(ball.score, 0)
  t:step_until(240, function() return ball.score > 0 end)
  t:step(120)
  t:expect_equal(ball.score, 1)
end)

test("a ball that rolls past the gate does not score", function(t)
  local ball = t:body("ball")
  t:place(ball, { position = vec(-4, 0.5, 8), velocity = vec(6, 0, 0) })
  t:step(240)
  t:expect_equal(ball.score, 0)
end)

test("the jump outlives the region that owns the ball", function(t)
  local ball = t:body("ball")
  t:step_until(240, function() return ball.score > 0 end)
  t:kill_region_of(ball)
  t:step_until(90, function() return ball:velocity().y > 2 end)
  t:expect_equal(ball.score, 1)
end)
)lua";

constexpr char kEditor[] = R"json({
  "runtime.version": "Lua 5.4",
  "workspace.library": [ ".tessera" ],
  "runtime.builtin": { "io": "disable", "os": "disable", "debug": "disable", "package": "disable", "coroutine": "disable" }
}
)json";

}  // namespace

std::vector<GameFile> NewGame(const std::string& name) {
  return {{"scene.json", absl::StrReplaceAll(kScene, {{"NAME", name}})},
          {"game.lua", kGame},
          {"game_test.lua", kTest},
          {".luarc.json", kEditor},
          {".tessera/tessera.lua", GameAnnotations()}};
}

}  // namespace tessera::game
