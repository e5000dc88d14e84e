// Terminal: a cluster of one host and a folder of its own, in which a reader types commands one after the other.
#pragma once

#include <string>
#include <vector>

#include "host/child_process.h"
#include "host/temporary_folder.h"
#include "local_cluster/local_cluster.h"

namespace tessera::programs {

class Terminal {
 public:
  struct Result {
    bool clean = false;  // it ended with 0
    std::string output;  // both streams together
  };
  // Runs the command to its end; one that asks for some seconds gets one.
  Result Type(const std::string& text);
  // The same, and expects that it ends with 0; one that runs until it is stopped shall print something, and is stopped.
  void Run(const std::string& text);
  const std::string& folder() const { return desk_.path(); }

 private:
  host::ChildProcess Start(const std::string& command);
  std::string Output() const;

  host::TemporaryFolder state_, desk_;
  local::LocalCluster cluster_{{.state_dir = state_.path(), .capacity = 16, .page_listen = "127.0.0.1:0"}};
  std::string output_ = state_.path() + "/output";
};

}  // namespace tessera::programs
