// DraftFile: a file that grows as its pieces come, is read when it is whole, and is gone with the object.
//
//   auto draft = DraftFile::Create(folder);
//   if (absl::Status status = draft->Append(piece); !status.ok()) return status;
//   const auto part = draft->Read(at, bytes);
//
// It has no name in its folder, so nothing of it is left when the process dies. Thread rule: one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::control {

class DraftFile {
 public:
  // UNAVAILABLE: no file can be made in the folder.
  static absl::StatusOr<DraftFile> Create(const std::string& folder);
  DraftFile(DraftFile&& other) noexcept : file_(std::exchange(other.file_, -1)), size_(other.size_) {}
  DraftFile& operator=(DraftFile&&) = delete;
  ~DraftFile();

  // UNAVAILABLE: the disk takes no more.
  absl::Status Append(std::string_view bytes);
  std::uint64_t size() const { return size_; }

  // So many bytes from `at`. DATA_LOSS: the file has not as many, or the disk does not give them.
  absl::StatusOr<std::string> Read(std::uint64_t at, std::uint64_t bytes) const;
  // Their SHA-256 in hexadecimal digits; they are never in memory as a whole.
  absl::StatusOr<std::string> Hash(std::uint64_t at, std::uint64_t bytes) const;
  // For reading from `at` on, as a stream of its own position.
  int file() const { return file_; }

 private:
  explicit DraftFile(int file) : file_(file) {}
  absl::Status ReadInto(std::uint64_t at, std::uint64_t bytes, char* out) const;

  int file_;
  std::uint64_t size_ = 0;
};

}  // namespace tessera::control
