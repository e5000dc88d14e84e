#include "bench/small_disk.h"

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

#include "absl/strings/str_cat.h"

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;

absl::Status NoDisk(const std::string& what) {
  return absl::UnavailableError(absl::StrCat(what, ": ", std::strerror(errno)));
}

}  // namespace

absl::Status EnterOwnMounts() {
  if (unshare(CLONE_NEWNS) != 0) return NoDisk("unshare");
  if (mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) return NoDisk("mounts of its own");
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<SmallDisk>> SmallDisk::Mount(const std::string& folder, std::uint64_t bytes) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) return absl::UnavailableError(absl::StrCat(folder, ": ", failed.message()));
  const std::string options = absl::StrCat("size=", bytes, ",mode=0700");
  if (mount("tmpfs", folder.c_str(), "tmpfs", MS_NOSUID | MS_NODEV, options.c_str()) != 0) {
    return NoDisk(absl::StrCat("cannot mount a disk at ", folder));
  }
  return std::unique_ptr<SmallDisk>(new SmallDisk(folder));
}

// Programs that still hold a file of it keep what they hold.
SmallDisk::~SmallDisk() { umount2(folder_.c_str(), MNT_DETACH); }

absl::Status SmallDisk::Fill() const {
  const int file = open(Filler().c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  // A disk that is full to its last page may have no room for a name either.
  if (file < 0) return errno == ENOSPC ? absl::OkStatus() : NoDisk(Filler());
  const std::vector<char> page(64 << 10);
  std::size_t piece = page.size();
  ssize_t written = 0;
  while (piece > 0) {
    written = write(file, page.data(), piece);
    if (written <= 0) piece /= 2;  // the room that is left is smaller
  }
  const int why = errno;
  close(file);
  errno = why;
  return why == ENOSPC ? absl::OkStatus() : NoDisk(Filler());
}

void SmallDisk::Free() const { unlink(Filler().c_str()); }

}  // namespace tessera::bench
