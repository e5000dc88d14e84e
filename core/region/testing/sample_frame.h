// A border frame with something in each part, for tests of its encoding.
#pragma once

#include <cmath>

#include "core/region/frame.h"

namespace tessera::region {

inline BodyState SampleState(double x, bool asleep = false) {
  BodyState state;
  state.position = {x, 1e-300, -x / 3};
  state.orientation = {0.6, 0, -0.0, std::nextafter(0.8, 1.0)};
  state.asleep = asleep;
  if (!asleep) {
    state.linear_velocity = {1.1F, -2.2F, 3.3F};
    state.angular_velocity = {0, 1e-40F, -5};
    state.angular_momentum = {-0.0F, 7e-41F, 1e20F};
    state.still_s = 0.25F;
  }
  return state;
}

inline BorderFrame SampleFrame() {
  BorderFrame frame;
  frame.tick = Tick(1'000'000);
  frame.sender = RegionId(3);
  frame.map_version = MapVersion(7);
  frame.ghosts = {{BodyId(1), Epoch(1), SampleState(1), {}, {}, {1, 2, 3}, {4, 5, 6}, true, true, 7.5F},
                  {BodyId(5), Epoch(200), SampleState(2, true), {}, {}, {}, {}},
                  {PlayerBodyId(PlayerNumber(2)), Epoch(9), SampleState(3), {1, 2, 3}, {4, 5, 6}, {}, {}}};
  frame.impulses = {{BodyId(1), BodyId(9), {1, 2, 3}, {4, 5, 6}, {7, 8, 9}}};
  Grant grant;
  grant.bodies = {{BodyId(20), Epoch(2), SampleState(4)}, {BodyId(21), Epoch(3), SampleState(5)}};
  grant.touching = {{BodyId(3), BodyId(20), true}};
  Grant player;
  player.bodies = {{PlayerBodyId(PlayerNumber(1)), Epoch(4), SampleState(6)}};
  player.control = {.last_input = 11,
                    .committed = true,
                    .next = {.number = 12, .force_n = {1, 0, 0}, .torque_nm = {0, 1, 0}},
                    .queue = {{.number = 13, .force_n = {1, 1, 1}, .torque_nm = {2, 2, 2}}, {.number = 15}}};
  frame.grants = {grant, player};
  frame.acknowledgements = {{BodyId(30), Epoch(31)}};
  frame.late_corrections = {{BodyId(40), {1, 2, 3}, {4, 5, 6}}};
  frame.inputs = {{.number = 77, .body = PlayerBodyId(PlayerNumber(4)), .force_n = {1, 2, 3}}};
  frame.properties = {{BodyId(1), {0, 10}}, {BodyId(5), {0, 0}}};
  return frame;
}

}  // namespace tessera::region
