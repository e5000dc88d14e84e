// FindLeader: which of several control planes leads, by their health: those that follow do not serve.
//
// Thread rule: any thread. Blocks for kFindLeaderPatience at most.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace tessera::trust {

struct Asked {
  std::string name;                                        // in errors
  absl::StatusOr<std::shared_ptr<grpc::Channel>> channel;  // or why there is none
};

// The channel of the first that says that it serves. UNAVAILABLE says of each why it is not the one.
absl::StatusOr<std::shared_ptr<grpc::Channel>> FindLeader(const std::vector<Asked>& members);

}  // namespace tessera::trust
