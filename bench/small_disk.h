// SmallDisk: a folder on a disk of its own, small enough to be filled, for programs that must live with a full one.
//
//   absl::Status own = EnterOwnMounts();                       // first thing in main: nobody else sees the disk
//   auto disk = SmallDisk::Mount("/tmp/x/host-1", 64 << 20);   // the folder is made, and empty
//   (*disk)->Fill();                                           // every write to it fails: no space left on device
//   (*disk)->Free();
//
// It is memory, and gone with the object. Thread rule: one thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::bench {

// This process, and all that it starts from here on, sees what it mounts, and nobody else does. Once, before any other
// thread is made; a user who is not root calls local::EnterOwnNetwork before. UNAVAILABLE where the machine does not
// allow it.
absl::Status EnterOwnMounts();

class SmallDisk {
 public:
  // UNAVAILABLE: the folder cannot be made, or nothing can be mounted there.
  static absl::StatusOr<std::unique_ptr<SmallDisk>> Mount(const std::string& folder, std::uint64_t bytes);
  ~SmallDisk();
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  // UNAVAILABLE: there is room left, whatever was tried. Filling a full one again is fine.
  absl::Status Fill() const;
  void Free() const;

 private:
  explicit SmallDisk(std::string folder) : folder_(std::move(folder)) {}
  std::string Filler() const { return folder_ + "/filler"; }

  const std::string folder_;
};

}  // namespace tessera::bench
