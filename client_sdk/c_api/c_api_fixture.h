// CApiTest: a client of the C interface that has joined a fake instance of one region, and has its scene.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <vector>

#include "client_sdk/include/tessera/connect.h"
#include "client_sdk/testing/fake_instance.h"
#include "client_sdk/testing/instance_door.h"

namespace tessera::client {

struct CApiTest : testing::Test {
  void SetUp() override {
    tessera_join_options options = TESSERA_JOIN_OPTIONS;
    options.control_address = instance.address.c_str();
    options.instance_id = FakeInstance::kId;
    options.bind_address = "127.0.0.1";
    ASSERT_EQ(tessera_join(&options, &client), TESSERA_OK) << tessera_last_error();
    ASSERT_TRUE(Until([&] { return HasScene(); }));
  }
  void TearDown() override { tessera_close(client); }
  // The regions have sent it.
  bool HasScene() const {
    tessera_scene_info scene = TESSERA_SCENE_INFO;
    return tessera_get_scene(client, &scene) == TESSERA_OK && scene.body_count > 0;
  }
  bool Until(const std::function<bool()>& done) {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!done() && std::chrono::steady_clock::now() < limit) {
      instance.Service();
      EXPECT_EQ(tessera_poll(client, now), TESSERA_OK) << tessera_last_error();
    }
    return done();
  }
  void Play() {
    ASSERT_TRUE(Until([&] { return tessera_get_state(client) == TESSERA_WAITING; }));
    instance.regions[0]->Start(Tick(0));
    ASSERT_TRUE(Until([&] { return tessera_get_state(client) == TESSERA_PLAYING; }));
  }
  void ShowTwo() {
    BodyState state;
    state.position = {1, 2, 3};
    state.linear_velocity = {4, 0, 0};
    const std::vector<replication::BodyRecord> bodies = {{BodyId(1), Epoch(1), state},
                                                         {BodyId(tessera_own_body(client)), Epoch(1), state}};
    instance.regions[0]->Snapshot(Tick(2), bodies);
    ASSERT_TRUE(Until([&] { return tessera_tick(client) == 2; }));
  }

  FakeInstance instance{1};
  InstanceDoor door{instance};
  tessera_client* client = nullptr;
  std::int64_t now = std::int64_t{3600} * 1'000'000'000;
};

}  // namespace tessera::client
