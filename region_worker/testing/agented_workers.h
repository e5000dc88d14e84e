// AgentedWorkers: real workers of one instance under an agent that is the test; the base of fixtures that give orders
// and wait for reports.
//
//   class WorkerAgentTest : public AgentedWorkers {
//     WorkerAgentTest() : AgentedWorkers("inst-3", kScene) {}
//   };
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "core/world/partition_io.h"
#include "core/world/scene_load.h"
#include "net/signing_key.h"
#include "region_worker/testing/fake_agent.h"
#include "region_worker/testing/worker_process.h"

namespace tessera::worker {

class AgentedWorkers : public testing::Test {
 protected:
  AgentedWorkers(std::string instance, const char* scene) : instance_(std::move(instance)) {
    const LoadedScene loaded = *LoadScene(SceneForm::kText, scene, "scene");
    scene_ = loaded.scene;
    scene_hash_ = loaded.hash;
    scene_path_ = WriteTestFile(instance_ + "_scene.pb", loaded.message.SerializeAsString());
  }
  ~AgentedWorkers() override { unlink(socket_.c_str()); }

  void StartWorker(std::uint32_t region) {
    workers_[region] = std::make_unique<WorkerProcess>(std::vector<std::string>{
        "--agent-socket", socket_, "--instance", instance_, "--region", std::to_string(region), "--incarnation", "5"});
  }
  // The next order for a region, by this map: what every order needs.
  v1::WorkerOrder OrderBy(const PartitionMap& map, std::uint32_t region) {
    v1::WorkerOrder order;
    order.set_revision(++revision_);
    order.set_instance_id(instance_);
    order.set_region(region);
    order.set_incarnation(5);
    order.set_scene_path(scene_path_);
    order.set_scene_hash(scene_hash_);
    *order.mutable_map() = ToProto(map);
    return order;
  }
  v1::WorkerReport Wait(std::uint32_t region, const std::function<bool(const v1::WorkerReport&)>& wanted) {
    auto report = agent_->WaitFor(region, wanted);
    EXPECT_TRUE(report.has_value()) << "no such report of region " << region;
    return report.value_or(v1::WorkerReport());
  }

  const std::string instance_;
  std::string socket_ = testing::TempDir() + "tw" + std::to_string(getpid()) + ".sock";
  const net::SigningKey key_ = net::SigningKey::Make();  // the instance's
  std::shared_ptr<const Scene> scene_;
  std::string scene_path_, scene_hash_;
  std::uint64_t revision_ = 0;
  std::unique_ptr<FakeAgent> agent_ = std::make_unique<FakeAgent>(socket_, key_);
  std::map<std::uint32_t, std::unique_ptr<WorkerProcess>> workers_;  // by region
};

}  // namespace tessera::worker
