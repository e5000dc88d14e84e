// A world with a gateway, and viewers of it.
#pragma once

#include <gtest/gtest.h>

#include <csignal>
#include <functional>
#include <initializer_list>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "gateway/testing/viewer_socket.h"
#include "host/child_process.h"
#include "host/files.h"
#include "host/temporary_folder.h"
#include "telemetry/http_get.h"
#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {

class GatewayTest : public WorldTest {
 protected:
  void StartWorld(std::uint32_t regions = 4) {
    Start({.scene = "", .regions = regions, .bots = kBots, .hosts = 2, .page_listen = "127.0.0.1:0"});
    ASSERT_FALSE(address().empty());
  }
  const std::string& address() { return run_->cluster().page_address(); }
  std::unique_ptr<gateway::ViewerSocket> Watch(const gateway::ViewerSocket::Options& options = {}) {
    return std::make_unique<gateway::ViewerSocket>(address(), run_->instance_id(), options);
  }
  // As a page does that was opened by the whole address: from now on the viewer gives orders by the key in it.
  void ShowKey(gateway::ViewerSocket& viewer) {
    viewer.Send({{"type", "authorize"}, {"number", 1}, {"key", run_->cluster().page_key()}});
    ASSERT_TRUE(Until({&viewer}, "the key is taken", [&] { return viewer.newest.contains("answer"); }));
    EXPECT_EQ(viewer.newest["answer"]["ok"], true) << viewer.newest["answer"];
    viewer.newest.erase("answer");
  }
  // Plays on, with viewers that read, until it holds.
  testing::AssertionResult Until(std::initializer_list<gateway::ViewerSocket*> viewers, const std::string& what,
                                 const std::function<bool()>& holds) {
    return PlayUntil(what, [&] {
      for (gateway::ViewerSocket* viewer : viewers) viewer->Take(std::chrono::milliseconds(0));
      return holds();
    });
  }
  static bool SeesAll(const gateway::ViewerSocket& viewer) { return viewer.decoder.bodies.size() >= kBodies + kBots; }
  static int RegionsAlive(const gateway::ViewerSocket& viewer) {
    const auto status = viewer.newest.find("status");
    if (status == viewer.newest.end()) return 0;
    int alive = 0;
    for (const nlohmann::json& region : status->second.at("regions")) alive += region.at("alive").get<bool>() ? 1 : 0;
    return alive;
  }
  // Memory of the gateway's process.
  static double ResidentBytes(const std::string& metrics_address) {
    const auto page = telemetry::HttpGet(metrics_address, "/metrics");
    if (!page.ok()) return 0;
    const std::string name = "\nprocess_resident_memory_bytes ";
    const std::size_t at = page->body.find(name);
    double bytes = 0;
    if (at == std::string::npos) return 0;
    const std::string rest = page->body.substr(at + name.size());
    return absl::SimpleAtod(rest.substr(0, rest.find('\n')), &bytes) ? bytes : 0;
  }
};

// A gateway beside the cluster's own.
class FurtherGateway {
 public:
  FurtherGateway(const std::string& control, const std::vector<std::string>& more) {
    std::vector<std::string> argv{support::BinaryPath("tessera-gateway"),
                                  "--control",
                                  control,
                                  "--listen",
                                  "127.0.0.1:0",
                                  "--metrics-listen",
                                  "127.0.0.1:0",
                                  "--ready-file",
                                  folder_.path() + "/ready"};
    argv.insert(argv.end(), more.begin(), more.end());
    auto started = host::ChildProcess::Start({.argv = argv, .log_path = folder_.path() + "/log"});
    EXPECT_TRUE(started.ok()) << started.status();
    process_.emplace(*std::move(started));
    EXPECT_TRUE(process_->WaitForFile(folder_.path() + "/ready", std::chrono::seconds(30)));
    const nlohmann::json ready = nlohmann::json::parse(host::ReadFile(folder_.path() + "/ready", 4096).value_or("{}"));
    address = ready.value("http", "");
    metrics = ready.value("metrics", "");
  }
  host::ExitStatus End() {
    process_->Signal(SIGTERM);
    return process_->Wait(std::chrono::seconds(30)).value_or(host::ExitStatus());
  }

  std::string address, metrics;

 private:
  host::TemporaryFolder folder_;
  std::optional<host::ChildProcess> process_;
};

}  // namespace tessera::end_to_end
