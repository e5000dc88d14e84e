// VisualCache: a folder of files by their hash, `<sha256>.glb`, that holds so many bytes at most.
//
// The file that was not asked for longest goes first. One whose content has another hash is removed and counts as
// missing.
// Several gateways of a machine may share one folder: names say the content, and files appear whole.
//
//   VisualCache cache("/var/cache/tessera-gateway/visuals", 1'000'000'000);
//   if (auto file = cache.Get(sha256); file.ok()) ...; else cache.Put(sha256, bytes);
//
// Thread rule: any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::gateway {

class VisualCache {
 public:
  // Without a folder it keeps nothing.
  explicit VisualCache(std::string folder = {}, std::uint64_t max_bytes = 0)
      : folder_(std::move(folder)), max_bytes_(max_bytes) {}

  // Makes the folder where it is missing, and removes what is too much in it. UNAVAILABLE: it cannot be written.
  absl::Status Open() const;
  // NOT_FOUND: it is not here.
  absl::StatusOr<std::string> Get(const std::string& sha256) const;
  // A file that cannot be kept is logged, and fetched again.
  void Put(const std::string& sha256, std::string_view bytes) const;

 private:
  std::string PathOf(const std::string& sha256) const;
  // Removes files until there is room for so many bytes.
  void MakeRoom(std::uint64_t bytes) const;

  std::string folder_;
  std::uint64_t max_bytes_ = 0;
};

}  // namespace tessera::gateway
