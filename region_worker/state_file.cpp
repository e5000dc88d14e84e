#include "region_worker/state_file.h"

#include <fcntl.h>
#include <sodium.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace tessera::worker {
namespace {

std::string Sha256(std::span<const std::uint8_t> bytes) {
  std::array<unsigned char, crypto_hash_sha256_BYTES> hash{};
  crypto_hash_sha256(hash.data(), bytes.data(), bytes.size());
  return absl::BytesToHexString({reinterpret_cast<const char*>(hash.data()), hash.size()});
}

absl::Status DiskError(const std::string& path) {
  return absl::UnavailableError(absl::StrCat(path, ": ", std::strerror(errno)));
}

bool WriteAll(int fd, const region::Bytes& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t part = write(fd, bytes.data() + done, bytes.size() - done);
    if (part < 0 && errno == EINTR) continue;
    if (part <= 0) return false;
    done += static_cast<std::size_t>(part);
  }
  return fsync(fd) == 0;
}

}  // namespace

absl::StatusOr<region::RegionState> LoadStateFile(const std::string& path, const std::string& hash,
                                                  const region::Catalog& catalog) {
  std::ifstream file(path, std::ios::binary);
  const region::Bytes bytes{std::istreambuf_iterator<char>(file), {}};
  if (!file.good() && !file.eof()) return absl::NotFoundError(absl::StrCat(path, ": cannot be read"));
  if (!hash.empty() && Sha256(bytes) != absl::AsciiStrToLower(hash)) {
    return absl::DataLossError(absl::StrCat(path, ": its hash is not the order's"));
  }
  absl::StatusOr<region::RegionState> state = region::DecodeState(bytes, catalog);
  if (!state.ok()) return absl::Status(state.status().code(), absl::StrCat(path, ": ", state.status().message()));
  return state;
}

absl::Status WriteStateFile(const std::string& path, const region::Bytes& bytes) {
  const std::string partial = path + ".partial";
  const int fd = open(partial.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (fd < 0) return DiskError(partial);
  const bool written = WriteAll(fd, bytes);
  const absl::Status failed = written ? absl::OkStatus() : DiskError(partial);
  close(fd);
  if (!written) return failed;
  return std::rename(partial.c_str(), path.c_str()) == 0 ? absl::OkStatus() : DiskError(path);
}

void StateWriter::Begin(Tick tick, std::string path, region::Bytes bytes) {
  writing_ = std::async(std::launch::async, [tick, path = std::move(path), bytes = std::move(bytes)] {
    return Written{tick, WriteStateFile(path, bytes)};
  });
}

std::optional<StateWriter::Written> StateWriter::Take() {
  if (!busy() || writing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return std::nullopt;
  return writing_.get();
}

}  // namespace tessera::worker
