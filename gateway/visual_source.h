// VisualSource: files of meshes as the control plane has them, or a bounded folder where they were kept.
//
// A gateway may begin on an empty disk: what somebody asks for is fetched by its hash, compared with it, and kept for
// the next time. Whoever is cut off halfway keeps nothing of it.
//
//   VisualSource source(channel, VisualCache("cache", bytes));
//   absl::StatusOr<std::string> file = source.Get(sha256);   // waits
//   source.Stop();                                           // at the end: nobody waits any longer
//
// Thread rule: any thread.
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "gateway/visual_cache.h"

namespace grpc {
class Channel;
class ClientContext;
}  // namespace grpc

namespace tessera::gateway {

class VisualSource {
 public:
  // For 64 MiB, and less than a page waits.
  static constexpr std::chrono::seconds kFetchPatience{50};

  VisualSource(std::shared_ptr<grpc::Channel> channel, VisualCache cache)
      : channel_(std::move(channel)), cache_(std::move(cache)) {}

  // NOT_FOUND: the control plane has no such file, or shows it to none with this token. UNAVAILABLE: it does not
  // answer, or did not go on. DATA_LOSS: what came has another hash or size.
  absl::StatusOr<std::string> Get(const std::string& sha256);
  // Ends what is under way with UNAVAILABLE, and all that is asked for afterwards.
  void Stop();

 private:
  absl::StatusOr<std::string> Fetch(const std::string& sha256);
  bool Begin(grpc::ClientContext& call);
  void End(grpc::ClientContext& call);

  const std::shared_ptr<grpc::Channel> channel_;
  VisualCache cache_;
  std::mutex mutex_;
  std::set<grpc::ClientContext*> calls_;
  bool stopped_ = false;
};

}  // namespace tessera::gateway
