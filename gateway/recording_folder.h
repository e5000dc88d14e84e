// RecordingFolder: the folder of a gateway's recordings: their names, how much room there is, and what a list says.
//
//   RecordingFolder folder("/var/lib/tessera-gateway/recordings", {});
//   if (auto place = folder.Make("plaza-1", now); place.ok()) client.Record(place->path, place->max_bytes);
//   auto path = folder.PathOf("plaza-1-20260101T000000Z.rec");      // a name from outside
//
// Thread rule: one thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace tessera::gateway {

struct RecordingLimits {
  std::uint64_t file_bytes = 1'000'000'000;     // one file
  std::uint64_t folder_bytes = 10'000'000'000;  // all in the folder
};

struct ListedRecording {
  std::string file;  // its name
  std::string instance;
  std::uint64_t bytes = 0;
  std::optional<double> seconds{};  // nothing: it was not ended, or is not yet
};

class RecordingFolder {
 public:
  // An empty path: no recordings are made, and there are none.
  RecordingFolder(std::string path, RecordingLimits limits) : path_(std::move(path)), limits_(limits) {}

  // Makes the folder where there is none. UNAVAILABLE: it cannot be made, or nothing can be written in it.
  absl::Status Open() const;

  struct Place {
    std::string file, path;
    std::uint64_t max_bytes = 0;
  };
  // For a recording that begins now, of a name that is not taken. FAILED_PRECONDITION: there is no folder;
  // RESOURCE_EXHAUSTED: it is full.
  absl::StatusOr<Place> Make(const std::string& instance, std::chrono::system_clock::time_point now) const;
  // NOT_FOUND: there is none of that name, which may be anything.
  absl::StatusOr<std::string> PathOf(std::string_view file) const;
  // The newest first, at most 1000.
  std::vector<ListedRecording> List() const;

 private:
  std::string path_;
  RecordingLimits limits_;
};

}  // namespace tessera::gateway
