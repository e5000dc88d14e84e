// A join grant as it is, and with a checksum that is right, so that what comes after the form is reached. One that is
// accepted is written to the same bytes that are read again.
#include <sodium.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "net/join_grant.h"
#include "tests/fuzz/planted_seed.h"

namespace {

using tessera::net::JoinGrant;

std::vector<std::uint8_t> SeedGrant() {
  using namespace tessera;
  using namespace tessera::net;
  JoinGrant grant{.player = PlayerNumber(7),
                  .credentials = IssuePlayer("plaza-1", PlayerNumber(7), Generation(1), SigningKey::Make()),
                  .map = *MakeGridMap({-8, -8, 8, 8}, 2),
                  .regions = {{RegionId(1), "10.0.0.1", 7777, Incarnation(1)}, {RegionId(2), "10.0.0.2", 7778}},
                  .scene_hash = std::string(64, 'a'),
                  .tick_rate_hz = 60,
                  .snapshot_rate_hz = 30,
                  .expected_players = 1};
  return EncodeJoinGrant(grant);
}

void Try(std::span<const std::uint8_t> bytes) {
  const auto read = tessera::net::DecodeJoinGrant(bytes);
  if (!read.ok()) {
    if (read.status().message().empty()) std::abort();
    return;
  }
  if (!tessera::net::DecodeJoinGrant(tessera::net::EncodeJoinGrant(*read)).ok()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  tessera::fuzz::PlantSeed(*argc, *argv, "grant", SeedGrant());
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  Try(bytes);
  if (size < 16) return 0;
  std::vector<std::uint8_t> summed(data, data + size);
  crypto_generichash(summed.data() + size - 16, 16, data, size - 16, nullptr, 0);
  Try(summed);
  return 0;
}
