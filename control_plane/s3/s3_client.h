// S3Client: objects of one bucket, by the part of Amazon's S3 protocol that all stores of its kind speak: path-style
// addresses, signatures of version 4 (libcurl's), ListObjectsV2.
//
//   S3Client client(settings);
//   absl::Status put = client.Put("inst-7/1200/region-1", bytes);
//
// Each request is tried kS3Tries times where the store does not answer, or says that it cannot now. The sum of what is
// put is part of the signature, so a store that got something else refuses it.
//
// Errors: UNAVAILABLE, no answer, or a fault of the store; PERMISSION_DENIED, it refuses who asks; NOT_FOUND, no such
// bucket or object; RESOURCE_EXHAUSTED, it is full or asked too often; DATA_LOSS, the answer is none or too large. Each
// names the store and what it said, and nothing secret.
//
// Thread rule: any thread. Calls block, at most some 45 s for a store that hangs.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/s3/s3_address.h"

namespace tessera::control {

inline constexpr int kS3Tries = 3;

struct S3Patience {
  std::chrono::milliseconds connect{5'000};
  // A request is given up when it was slower than 1 kB/s for so long.
  std::chrono::seconds slow{10};
  std::chrono::milliseconds between_tries{200};  // twice as long each time
};

class S3Client {
 public:
  explicit S3Client(S3Settings settings, S3Patience patience = {});
  ~S3Client();

  absl::Status Put(const std::string& key, const std::string& bytes);
  absl::StatusOr<std::string> Get(const std::string& key, std::size_t max_bytes);
  // OK, too, where there is none.
  absl::Status Delete(const std::string& key);

  struct Listing {
    std::vector<std::string> keys;     // without the settings' prefix, ascending
    std::vector<std::string> folders;  // likewise, with '/' at the end
  };
  // All that begins with `prefix`; where a '/' follows, the folder alone, if `by_folder`. At most `max`, which is 1 to
  // 100 000.
  absl::StatusOr<Listing> List(const std::string& prefix, bool by_folder, std::size_t max = 100'000);

  const std::string& name() const { return settings_.name; }
  // Requests under way end within a second, as UNAVAILABLE, and so do later ones.
  void Stop() { stopped_ = true; }

 private:
  struct Request;
  struct Answer;
  absl::StatusOr<Answer> Send(const Request& request);
  absl::StatusOr<Answer> TryOnce(const Request& request);
  absl::Status StatusOf(const Request& request, const Answer& answer) const;

  const S3Settings settings_;
  const S3Patience patience_;
  std::atomic<bool> stopped_{false};
};

}  // namespace tessera::control
