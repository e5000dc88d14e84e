#include "control_plane/http_pages.h"

#include <unistd.h>

#include <nlohmann/json.hpp>

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

void AddPages(telemetry::MetricsServer& server, ControlPlane& plane) {
  server.AddHandler("/healthz", [](const telemetry::HttpRequest&) { return telemetry::HttpReply{.body = "ok\n"}; });
  server.AddHandler("/sd/prometheus", [&plane, own = Reachable(server.address())](const telemetry::HttpRequest&) {
    const auto targets = plane.Call([](Cluster& cluster, Now) { return ScrapeTargets(cluster.state()); });
    return telemetry::HttpReply{.content_type = "application/json", .body = ScrapeTargetsJson(targets, own)};
  });
}

}  // namespace tessera::control
