#include "host/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "absl/strings/str_cat.h"

namespace tessera::host {
namespace {

constexpr std::size_t kPieceBytes = 4096;  // files that claim no size, as those of /proc, are mostly smaller

absl::Status FileError(const std::string& path, int error) {
  const std::string message = absl::StrCat(path, ": ", std::strerror(error));
  return error == ENOENT ? absl::NotFoundError(message) : absl::UnavailableError(message);
}

// A file descriptor that is closed with this object.
class Descriptor {
 public:
  explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
  ~Descriptor() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return descriptor_; }

 private:
  int descriptor_;
};

// 0, or the value of errno.
int WriteAll(int descriptor, std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = write(descriptor, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

// 0, or the value of errno.
int WriteAndSync(int descriptor, std::string_view content, Durability durability) {
  if (const int error = WriteAll(descriptor, content); error != 0) return error;
  return durability == Durability::kSurvivesMachine && fsync(descriptor) != 0 ? errno : 0;
}

}  // namespace

absl::StatusOr<std::string> ReadFile(const std::string& path, std::size_t max_bytes) {
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) return FileError(path, errno);
  // Read to its end, whatever size it claims, since it may grow meanwhile.
  struct stat info {};
  fstat(file.get(), &info);
  const std::size_t piece = std::min(std::max<std::size_t>(info.st_size, kPieceBytes), max_bytes) + 1;
  std::string content;
  for (;;) {
    const std::size_t size = content.size();
    content.resize(size + piece);
    const ssize_t got = read(file.get(), content.data() + size, piece);
    const int error = errno;
    content.resize(size + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    if (got < 0 && error == EINTR) continue;
    if (got < 0) return FileError(path, error);
    if (got == 0) return content;
    if (content.size() > max_bytes) {
      return absl::ResourceExhaustedError(absl::StrCat(path, ": holds more than ", max_bytes, " bytes"));
    }
  }
}

absl::Status WriteFile(const std::string& path, std::string_view content, Durability durability) {
  // The temporary file has a name of its own, so that two threads which write the same file do not share it, and lies
  // in the same folder, so that the rename is atomic.
  std::string temporary = path + ".XXXXXX";
  int error = 0;
  {
    const Descriptor file(mkostemp(temporary.data(), O_CLOEXEC));
    if (file.get() < 0) return absl::UnavailableError(absl::StrCat(path, ": ", std::strerror(errno)));
    error = WriteAndSync(file.get(), content, durability);
  }
  if (error == 0 && std::rename(temporary.c_str(), path.c_str()) != 0) error = errno;
  if (error != 0) {
    unlink(temporary.c_str());
    return absl::UnavailableError(absl::StrCat(path, ": ", std::strerror(error)));
  }
  if (durability == Durability::kSurvivesProcess) return absl::OkStatus();
  return SyncFolder(std::filesystem::path(path).parent_path());
}

absl::Status MakePrivateFolder(const std::string& path) {
  std::error_code error;
  const bool made = std::filesystem::create_directories(path, error);
  if (!error && made) std::filesystem::permissions(path, std::filesystem::perms::owner_all, error);
  return error ? absl::UnavailableError(absl::StrCat(path, ": ", error.message())) : absl::OkStatus();
}

absl::Status SyncFolder(const std::string& path) {
  const Descriptor folder(open(path.empty() ? "." : path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.get() < 0 || fsync(folder.get()) != 0) return FileError(path, errno);
  return absl::OkStatus();
}

}  // namespace tessera::host
