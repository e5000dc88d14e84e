// JoinRequests: carries out what comes in at the players' door in JSON (join_page.h), counts it and writes the log's
// line of it. It knows of no socket.
//
//   JoinRequests requests(plane, metrics, JoinRequests::Askers::kStrangers);
//   PageAnswer answer = requests.CarryOut({.path = "/v1/join", .body = body, ...}, [&] { return hung_up; });
//
// Thread rule: CarryOut on any thread, which waits in it, a join as long as its world takes to start. `plane` and
// `metrics` outlive it.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "control_plane/control_metrics.h"
#include "control_plane/control_plane.h"
#include "control_plane/join_page.h"
#include "telemetry/log_throttle.h"

namespace tessera::control {

struct PageRequest {
  std::string path, body;
  std::string from;     // in the log: "192.0.2.7", "local"
  std::string address;  // by which strangers are counted
};

class JoinRequests {
 public:
  // Programs of this machine are no strangers: their guests are not counted by address.
  enum class Askers : std::uint8_t { kStrangers, kLocal };

  JoinRequests(ControlPlane& plane, ControlMetrics& metrics, Askers askers)
      : plane_(plane), metrics_(metrics), askers_(askers) {}

  // True: /v1/join, /v1/leave and /v1/instances.
  static bool Has(std::string_view path);
  // Requires that there is such a path. `given_up`: nobody reads the answer any more.
  PageAnswer CarryOut(const PageRequest& request, const std::function<bool()>& given_up);

 private:
  struct Outcome {
    PageAnswer answer;
    absl::Status status;
    std::string subject;  // the instance, where the request names one
  };
  Outcome Join(const PageRequest& request, const std::function<bool()>& given_up);
  Outcome Leave(const PageRequest& request);
  Outcome List(const PageRequest& request);
  void Log(const PageRequest& request, const Outcome& outcome, std::chrono::nanoseconds took);

  ControlPlane& plane_;
  ControlMetrics& metrics_;
  const Askers askers_;
  telemetry::LogThrottle refusals_, answered_;
};

}  // namespace tessera::control
