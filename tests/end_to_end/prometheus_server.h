// PrometheusServer: Debian's Prometheus as a child process, with deploy/prometheus/prometheus.yml pointed at a control
// plane and a gateway.
//
// Only their addresses and the intervals (1 s instead of 5 s, so that a test need not wait) differ
// from the file that operators install. Destruction ends it. Thread rule: one thread.
#pragma once

#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "host/child_process.h"

namespace tessera::end_to_end {

class PrometheusServer {
 public:
  // `folder` exists and takes its configuration, data and log. Throws std::runtime_error if it does not become ready.
  PrometheusServer(const std::string& discovery_address, const std::string& gateway_address, const std::string& folder);
  ~PrometheusServer();

  const std::string& address() const { return address_; }
  // `data` of the answer of its HTTP API to e.g. "/api/v1/targets". Throws on an error, with Prometheus's own words.
  nlohmann::json Api(const std::string& path_and_query) const;
  // `data.result` of an instant query.
  nlohmann::json Query(const std::string& expression) const;
  // True as soon as `holds` is, which is asked anew whenever Prometheus has written down what it scraped; false when it
  // did not become so within `patience`, which only a failing test waits out.
  bool Until(const std::function<bool()>& holds, std::chrono::seconds patience = std::chrono::seconds(90)) const;

 private:
  std::string address_;
  std::string log_folder_;  // where it writes ahead
  host::ChildProcess process_;
};

}  // namespace tessera::end_to_end
