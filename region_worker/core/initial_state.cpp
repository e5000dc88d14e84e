#include "region_worker/core/initial_state.h"

#include <sodium.h>

#include <array>
#include <string>

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

}  // namespace

absl::StatusOr<region::RegionState> ReadInitialState(const StateFile& file, std::span<const std::uint8_t> bytes,
                                                     const region::Catalog& catalog) {
  if (!file.hash.empty() && Sha256(bytes) != absl::AsciiStrToLower(file.hash)) {
    return absl::DataLossError(absl::StrCat(file.path, ": its hash is not the order's"));
  }
  absl::StatusOr<region::RegionState> state = region::DecodeState(bytes, catalog);
  if (!state.ok()) return absl::Status(state.status().code(), absl::StrCat(file.path, ": ", state.status().message()));
  if (state->tick != file.tick) {
    return absl::DataLossError(absl::StrCat(file.path, ": it is of tick ", state->tick.value()));
  }
  return state;
}

}  // namespace tessera::worker
