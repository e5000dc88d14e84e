// For tests of the worker's core: a world of a few balls, and what a part has asked for.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/region/region.h"
#include "core/world/partition_map.h"
#include "core/world/scene.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/link_message.h"

namespace tessera::worker {

// Balls that fly along x at 1 m/s, 2 m apart, on a ground of 20 m by 20 m without gravity.
inline std::shared_ptr<const Scene> SmallWorld(int balls = 4) {
  auto scene = std::make_shared<Scene>();
  scene->name = "small";
  scene->bounds = {{-10, -10, -10}, {10, 10, 10}};
  scene->gravity_m_s2 = {};
  for (int i = 0; i < balls; ++i) {
    BodyDef& ball = scene->bodies.emplace_back();
    ball.id = BodyId(static_cast<std::uint64_t>(i) + 1);
    ball.shape = std::make_shared<const Shape>(Shape{SphereShape{0.3}});
    ball.mass_kg = 1;
    ball.may_sleep = false;
    ball.initial.position = {-8, 0, -6.0 + 2 * i};
    ball.initial.linear_velocity = {1, 0, 0};
  }
  return scene;
}

inline region::Config ConfigOf(std::uint32_t region, std::uint32_t regions,
                               const std::shared_ptr<const Scene>& scene = SmallWorld()) {
  return {RegionId(region),         Incarnation(1), scene, *MakeGridMap(scene->ground(), regions),
          region::RegionSettings(), nullptr};
}

// The same for regions that promise nothing, so that each waits for every frame of the other.
inline region::Config WithoutPromises(region::Config config) {
  config.settings.promise_ticks = 0;
  return config;
}

// Messages among `actions`, in order; they refer to the bytes that `bytes` keeps.
struct SentMessage {
  RegionId to;
  std::shared_ptr<const region::Bytes> bytes;
  LinkMessage message;
};

// Takes the messages out of the actions, and drops the rest.
inline std::vector<SentMessage> TakeSent(Actions& actions) {
  std::vector<SentMessage> sent;
  for (const Action& action : actions) {
    const auto* send = std::get_if<SendMessage>(&action);
    if (send == nullptr) continue;
    sent.push_back({send->to, send->message, ReadLinkMessage(*send->message).value_or(LinkMessage())});
  }
  actions.clear();
  return sent;
}

template <class Wanted>
std::vector<Wanted> AllOf(const Actions& actions) {
  std::vector<Wanted> all;
  for (const Action& action : actions) {
    if (const auto* wanted = std::get_if<Wanted>(&action)) all.push_back(*wanted);
  }
  return all;
}

}  // namespace tessera::worker
