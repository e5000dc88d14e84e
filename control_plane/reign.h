// Reign: a control plane for as long as it leads: the cluster's state as the store has it, the doors, the pages.
//
// Beginning one is what a restart is: everything is read from the store, a new life begins on it, and every worker's
// lease counts as renewed at this moment. Ending one ends all calls and drops the state; the store stays.
//
//   auto reign = Reign::Begin(store, settings, metrics, pages);
//
// Thread rule: begin and end it from one thread.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "control_plane/control_metrics.h"
#include "control_plane/control_plane.h"
#include "control_plane/control_settings.h"
#include "control_plane/grpc_server.h"
#include "control_plane/http_pages.h"
#include "control_plane/https_door.h"
#include "control_plane/s3/s3_address.h"
#include "control_plane/store.h"
#include "control_plane/timed_store.h"
#include "telemetry/metrics_server.h"

namespace tessera::control {

// The players' door for HTTPS. Without a certificate of its own it shows one of the cluster's authority.
struct HttpsFlags {
  std::string listen{};              // empty: there is none
  std::string certificate{}, key{};  // files
};

struct ReignSettings {
  GrpcDoors doors;  // beside the socket is one of the players' door in JSON
  HttpsFlags https{};
  std::string seal;                      // file with the passphrase of the authority's key
  std::string checkpoints;               // folder or address of a bucket, in errors
  std::optional<S3Settings> s3{};        // where it is a bucket
  std::uint64_t checkpoint_reserve = 0;  // bytes of its disk that they leave free
  std::string store_name;                // in errors: "/var/lib/tessera/control/control.db"
  ControlSettings control;
};

// The HTTP side of a process, which outlives its reigns.
struct Pages {
  telemetry::MetricsServer& server;
  std::shared_ptr<PlaneGate> gate = std::make_shared<PlaneGate>();
};

class Reign {
 public:
  // FAILED_PRECONDITION: the checkpoints are not those of the store (cluster_mark.h), or the seal is not that of its
  // authority; others as those of reading the store and of GrpcServer::Start. All but the settings outlive it.
  static absl::StatusOr<std::unique_ptr<Reign>> Begin(Store& store, const ReignSettings& settings,
                                                      ControlMetrics& metrics, const Pages& pages,
                                                      LeaderRights rights = {});
  ~Reign();

  const GrpcServer& grpc() const { return *grpc_; }
  std::string https_address() const { return https_ ? https_->address() : ""; }

 private:
  Reign(Store& store, ControlMetrics& metrics, std::shared_ptr<PlaneGate> gate)
      : metrics_(metrics),
        gate_(std::move(gate)),
        store_(store, [&metrics](std::chrono::nanoseconds took) { metrics.ObserveWrite(took); }),
        cluster_store_(
            store, [&metrics](std::chrono::nanoseconds took) { metrics.ObserveWrite(took); },
            [this](std::chrono::nanoseconds last_took) {
              if (ControlPlane* plane = noting_) plane->NoteWrite(last_took);
            }) {}

  ControlMetrics& metrics_;
  std::shared_ptr<PlaneGate> gate_;
  std::atomic<ControlPlane*> noting_ = nullptr;  // it notes writes
  TimedStore store_, cluster_store_;  // the second is written under the cluster's lock, or before there is one
  std::unique_ptr<ControlPlane> plane_;
  std::unique_ptr<HttpsDoor> https_, local_https_;
  std::unique_ptr<GrpcServer> grpc_;
  std::shared_ptr<SummaryMetrics> summary_;
};

}  // namespace tessera::control
