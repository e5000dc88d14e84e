#include "tests/end_to_end/prometheus_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>
#include <regex>
#include <stdexcept>

#include "host/file_watch.h"
#include "host/last_lines.h"
#include "telemetry/http_get.h"
#include "tests/end_to_end/dashboard.h"

namespace tessera::end_to_end {
namespace {

constexpr std::chrono::seconds kReadyTimeout{60};

// Prometheus 2.42 cannot say which port it took, so one that was free a moment ago is given to it.
std::string FreeAddress() {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  const bool found = bind(fd, reinterpret_cast<const sockaddr*>(&address), size) == 0 &&
                     getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  close(fd);
  if (!found) throw std::runtime_error("no free port on 127.0.0.1");
  return "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
}

void Write(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

std::string Replaced(const std::string& config, const std::string& expression, const std::string& replacement) {
  std::string changed = std::regex_replace(config, std::regex(expression), replacement);
  if (changed == config) throw std::runtime_error("deploy/prometheus/prometheus.yml has no " + expression);
  return changed;
}

host::ChildProcess Start(const std::string& address, const std::string& discovery_address,
                         const std::string& gateway_address, const std::string& folder) {
  std::string config = ReadSource("deploy/prometheus/prometheus.yml");
  config = Replaced(config, "http://127\\.0\\.0\\.1:7701/", "http://" + discovery_address + "/");
  config = Replaced(config, "\"127\\.0\\.0\\.1:7711\"", '"' + gateway_address + '"');
  config = Replaced(config, "(_interval|scrape_timeout): \\ds", "$1: 1s");
  Write(folder + "/prometheus.yml", config);
  Write(folder + "/rules.yml", ReadSource("deploy/prometheus/rules.yml"));
  auto process =
      host::ChildProcess::Start({.argv = {TESSERA_PROMETHEUS, "--config.file=" + folder + "/prometheus.yml",
                                          "--storage.tsdb.path=" + folder + "/data", "--web.listen-address=" + address},
                                 .log_path = folder + "/prometheus.log"});
  if (!process.ok()) throw std::runtime_error(process.status().ToString());
  return *std::move(process);
}

}  // namespace

PrometheusServer::PrometheusServer(const std::string& discovery_address, const std::string& gateway_address,
                                   const std::string& folder)
    : address_(FreeAddress()),
      log_folder_(folder + "/data/wal"),
      process_(Start(address_, discovery_address, gateway_address, folder)) {
  const auto deadline = std::chrono::steady_clock::now() + kReadyTimeout;
  while (true) {
    const auto answer = telemetry::HttpGet(address_, "/-/ready");
    if (answer.ok() && answer->status == 200) return;
    if (process_.Wait(std::chrono::milliseconds(50)) || std::chrono::steady_clock::now() > deadline) {
      throw std::runtime_error("prometheus did not become ready" + host::LastLinesText(folder + "/prometheus.log", 5));
    }
  }
}

PrometheusServer::~PrometheusServer() { process_.End(std::chrono::seconds(10)); }

nlohmann::json PrometheusServer::Api(const std::string& path_and_query) const {
  const auto answer = telemetry::HttpGet(address_, path_and_query);
  if (!answer.ok()) throw std::runtime_error(answer.status().ToString());
  auto json = nlohmann::json::parse(answer->body);
  if (json.at("status") != "success") throw std::runtime_error(path_and_query + ": " + answer->body);
  return json.at("data");
}

nlohmann::json PrometheusServer::Query(const std::string& expression) const {
  return Api("/api/v1/query?query=" + telemetry::UrlEncode(expression)).at("result");
}

bool PrometheusServer::Until(const std::function<bool()>& holds, std::chrono::seconds patience) const {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  host::FileWatch written(log_folder_);
  while (!holds()) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (!written.Wait(left)) return false;
  }
  return true;
}

}  // namespace tessera::end_to_end
