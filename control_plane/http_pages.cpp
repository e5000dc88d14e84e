#include "control_plane/http_pages.h"

#include <unistd.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "control_plane/remembered.h"

namespace tessera::control {
namespace {

nlohmann::json Group(const std::string& address, nlohmann::json labels) {
  return {{"targets", {address}}, {"labels", std::move(labels)}};
}

// An address that listens everywhere is no address to scrape; this machine's name is.
std::string Reachable(const std::string& address) {
  for (const std::string everywhere : {"0.0.0.0:", "[::]:"}) {
    if (!address.starts_with(everywhere)) continue;
    char name[256] = {};
    if (gethostname(name, sizeof name - 1) == 0) return name + address.substr(everywhere.size() - 1);
  }
  return address;
}

}  // namespace

std::string ScrapeTargetsJson(const std::vector<ScrapeTarget>& targets, const std::string& own_address) {
  nlohmann::json list = nlohmann::json::array();
  list.push_back(Group(own_address, {{"component", "control"}}));
  for (const ScrapeTarget& target : targets) {
    if (target.instance_id.empty()) {
      list.push_back(Group(target.address, {{"component", "agent"}, {"host", target.host}}));
    } else {
      list.push_back(Group(target.address, {{"component", "region"},
                                            {"host", target.host},
                                            {"instance_id", target.instance_id},
                                            {"region", std::to_string(target.region)}}));
    }
  }
  return list.dump();
}

void AddPages(telemetry::MetricsServer& server, const std::shared_ptr<PlaneGate>& gate) {
  server.AddHandler("/healthz", [gate](const telemetry::HttpRequest&) {
    std::string trouble;
    const bool leads = gate->With([&trouble](ControlPlane& plane) { trouble = plane.Trouble(); });
    if (!trouble.empty()) return telemetry::HttpReply{.status = 503, .body = trouble + "\n"};
    return telemetry::HttpReply{.body = leads ? "ok\n" : "ok, follows\n"};
  });
  const auto targets = std::make_shared<Remembered<std::string>>([gate, own = Reachable(server.address())] {
    std::vector<ScrapeTarget> found;
    gate->With([&](ControlPlane& plane) {
      found = plane.Call([](Cluster& cluster, Now) { return ScrapeTargets(cluster.state()); });
    });
    return ScrapeTargetsJson(found, own);
  });
  server.AddHandler("/sd/prometheus", [targets](const telemetry::HttpRequest&) {
    return telemetry::HttpReply{.content_type = "application/json",
                                .body = targets->Get(std::chrono::steady_clock::now())};
  });
}

}  // namespace tessera::control
