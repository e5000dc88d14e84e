// From the address that a gateway says to the first frame over a socket, as a browser gets there: the page, what it
// names, the socket.
#include <chrono>
#include <memory>
#include <regex>

#include "bench/people_scenes.h"
#include "bench/people_stage.h"
#include "local_cluster/command_error.h"
#include "telemetry/http_get.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;

std::string Fetch(const std::string& address, const std::string& path) {
  const telemetry::HttpAnswer answer = local::OrThrow(telemetry::HttpGet(address, path));
  if (answer.status != 200) throw local::CommandError("http://" + address + path + ": " + answer.body);
  return answer.body;
}

double ReadyMs(const std::string& control, const std::string& instance) {
  const GatewayProcess gateway(control);
  const auto begin = Clock::now();
  const std::string page = Fetch(gateway.address(), "/");
  static const std::regex named("(?:src|href)=\"(/?assets/[^\"]+)\"");
  for (auto at = std::sregex_iterator(page.begin(), page.end(), named); at != std::sregex_iterator(); ++at) {
    const std::string path = (*at)[1];
    Fetch(gateway.address(), path.front() == '/' ? path : "/" + path);
  }
  Viewers viewer(gateway.address(), instance, 1);
  viewer.AwaitFrames();
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

}  // namespace

absl::Status RunReady(const PeopleSize& size, Report& report) {
  local::WorldRun run(PlazaOptions(size.bodies));
  SettlePlaza(run);
  std::vector<double> ms;
  for (std::uint32_t i = 0; i < size.starts; ++i) {
    ms.push_back(ReadyMs(run.cluster().control_address(), run.instance_id()));
    RequireRunning(run);
  }
  report.Add("ready", kPeopleEngine, "", "starts", size.starts, "1");
  AddSpread(report, "ready", "", "page_ready_ms", ms, "ms");
  return absl::OkStatus();
}

}  // namespace tessera::bench
