// A checkpoint as one file, for another cluster: a line that says what it is, a sum, and a records::Bundle.
//
//   const std::string bytes = Bundle(bundle);
//   auto read = BundleReader::Open(draft);            // all sums are compared
//   const auto scene = read->Read(kSceneFile);
//
// Reading keeps one of its files in memory at a time, since a file from outside may have half a gigabyte.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "absl/status/statusor.h"
#include "control_plane/control_records.pb.h"
#include "control_plane/draft_file.h"

namespace tessera::control {

std::string Bundle(const records::Bundle& bundle);
void AddContent(records::Bundle& bundle, const std::string& name, std::string bytes);

class BundleReader {
 public:
  // INVALID_ARGUMENT, DATA_LOSS: "file: region-2 is missing or damaged". The draft outlives it.
  static absl::StatusOr<BundleReader> Open(const DraftFile& file);

  // It names the scene, the game where hosts have none, and one file for each region of its map, and nothing else.
  const records::Manifest& manifest() const { return manifest_; }
  // One of those.
  absl::StatusOr<std::string> Read(const std::string& name) const;

 private:
  struct Place {
    std::uint64_t at = 0, bytes = 0;
  };
  explicit BundleReader(const DraftFile& file) : file_(file) {}
  bool Parse(std::uint64_t begin);
  absl::Status CheckFiles() const;

  const DraftFile& file_;
  records::Manifest manifest_;
  std::map<std::string, Place> contents_;
};

}  // namespace tessera::control
