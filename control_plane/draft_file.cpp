#include "control_plane/draft_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <span>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/world/sha256.h"

namespace tessera::control {
namespace {

constexpr std::size_t kHashedBytes = std::size_t{1} << 20;  // at a time

}  // namespace

absl::StatusOr<DraftFile> DraftFile::Create(const std::string& folder) {
  std::string path = folder + "/.draft-XXXXXX";
  const int file = mkostemp(path.data(), O_CLOEXEC);
  if (file < 0) return absl::UnavailableError(absl::StrCat(folder, ": ", std::strerror(errno)));
  unlink(path.c_str());
  return DraftFile(file);
}

DraftFile::~DraftFile() {
  if (file_ >= 0) close(file_);
}

absl::Status DraftFile::Append(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = pwrite(file_, bytes.data(), bytes.size(), static_cast<off_t>(size_));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return absl::UnavailableError(absl::StrCat("a draft cannot be written: ", std::strerror(errno)));
    size_ += static_cast<std::uint64_t>(written);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return absl::OkStatus();
}

absl::Status DraftFile::ReadInto(std::uint64_t at, std::uint64_t bytes, char* out) const {
  while (bytes > 0) {
    const ssize_t read = pread(file_, out, bytes, static_cast<off_t>(at));
    if (read < 0 && errno == EINTR) continue;
    if (read <= 0) return absl::DataLossError(read < 0 ? std::strerror(errno) : "ends too soon");
    at += static_cast<std::uint64_t>(read);
    out += read;
    bytes -= static_cast<std::uint64_t>(read);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> DraftFile::Read(std::uint64_t at, std::uint64_t bytes) const {
  if (at > size_ || bytes > size_ - at) return absl::DataLossError("ends too soon");
  std::string read(bytes, '\0');
  if (absl::Status status = ReadInto(at, bytes, read.data()); !status.ok()) return status;
  return read;
}

absl::StatusOr<std::string> DraftFile::Hash(std::uint64_t at, std::uint64_t bytes) const {
  Sha256 sum;
  for (std::uint64_t read = 0; read < bytes;) {
    const auto part = Read(at + read, std::min<std::uint64_t>(bytes - read, kHashedBytes));
    if (!part.ok()) return part.status();
    sum.Add(std::span(reinterpret_cast<const std::uint8_t*>(part->data()), part->size()));
    read += part->size();
  }
  const Sha256::Digest digest = sum.Finish();
  return absl::BytesToHexString({reinterpret_cast<const char*>(digest.data()), digest.size()});
}

}  // namespace tessera::control
