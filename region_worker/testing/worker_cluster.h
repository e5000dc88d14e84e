// For tests: workers of one world, one a region, each the real program, without agents and control plane.
//
//   WorkerCluster cluster(2, kScene, {"--players", "1"});
//   const auto client = cluster.Join(1, 1);
//
// Thread rule: one thread. Destruction kills what still runs.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "region_worker/input_files.h"
#include "region_worker/testing/test_client.h"
#include "region_worker/testing/worker_process.h"

namespace tessera::worker {

inline double MetricIn(const std::string& page, const std::string& series) {
  const auto at = page.find("\n" + series + " ");
  return at == std::string::npos ? -1 : std::atof(page.c_str() + at + series.size() + 2);
}

inline double Metric(std::uint16_t port, const std::string& series) { return MetricIn(ReadMetrics(port), series); }

class WorkerCluster {
 public:
  // `more`: arguments of each.
  WorkerCluster(std::uint32_t regions, const std::string& scene, const std::vector<std::string>& more = {})
      : base_(FreeBasePort(regions)) {
    const std::string file = WriteTestFile("world.textproto", scene);
    scene_ = *LoadSceneFile(file);
    for (std::uint32_t region = 1; region <= regions; ++region) {
      std::vector<std::string> arguments = {"--scene",     file,
                                            "--regions",   std::to_string(regions),
                                            "--region",    std::to_string(region),
                                            "--base-port", std::to_string(base_)};
      arguments.insert(arguments.end(), more.begin(), more.end());
      workers_.push_back(std::make_unique<WorkerProcess>(arguments));
    }
    for (auto& worker : workers_) EXPECT_TRUE(worker->WaitForLine("listening")) << worker->said();
  }

  const Scene& scene() const { return *scene_; }
  WorkerProcess& worker(std::uint32_t region) { return *workers_.at(region - 1); }
  std::uint16_t game_port(std::uint32_t region) const { return static_cast<std::uint16_t>(base_ + 3 * (region - 1)); }
  std::uint16_t metrics_port(std::uint32_t region) const { return static_cast<std::uint16_t>(game_port(region) + 2); }
  std::unique_ptr<TestClient> Join(std::uint32_t region, std::uint32_t player) {
    auto client = std::make_unique<TestClient>(scene_->bounds);
    EXPECT_TRUE(client->Connect(game_port(region), RegionId(region), CredentialsFor(player)));
    EXPECT_TRUE(client->Until([&] { return client->welcome.has_value(); }));
    return client;
  }

 private:
  std::uint16_t base_;
  std::shared_ptr<const Scene> scene_;
  std::vector<std::unique_ptr<WorkerProcess>> workers_;
};

}  // namespace tessera::worker
