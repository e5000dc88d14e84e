// TrustStage: a cluster with all its doors open on loopback, as those who attack it see it.
//
// Thread rule: one thread; CommandError where something cannot be started.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host/temporary_folder.h"
#include "local_cluster/connection.h"
#include "local_cluster/local_cluster.h"
#include "tests/support/attacks.h"

namespace tessera::bench {

class TrustStage {
 public:
  explicit TrustStage(std::vector<std::string> control_arguments = {});

  const support::Target& target() const { return target_; }
  local::Connection& connection() { return *connection_; }
  double ControlMegabytes() const { return support::ResidentMegabytes(cluster_->control().pid()); }
  double AnonymousMegabytes() const { return support::AnonymousMegabytes(cluster_->control().pid()); }
  // The control plane's heap in use, as its metric says.
  double HeapMegabytes() const;
  // The secret of a token with an operator's role.
  std::string OperatorsToken();
  // The id of a world that takes guests; lazy: no worker runs until somebody joins.
  std::string CreateWorld(bool lazy);
  // One of four regions that runs, takes as many guests, and keeps who has not connected for an hour.
  std::string CreateWorldFor(std::uint32_t players);
  v1::Instance World(const std::string& id);
  void DeleteWorld(const std::string& id);

 private:
  std::string Create(const v1::InstanceSpec& spec);

  host::TemporaryFolder folder_;
  std::unique_ptr<local::LocalCluster> cluster_;
  std::unique_ptr<local::Connection> connection_;
  support::Target target_;
};

}  // namespace tessera::bench
