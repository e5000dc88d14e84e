#include "tests/support/region_keys.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>
#include <grpcpp/grpcpp.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <functional>
#include <optional>
#include <span>
#include <sstream>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "agent/agent_state.pb.h"
#include "client_sdk/control_session.h"
#include "core/region/rules.h"
#include "core/world/byte_view.h"
#include "local_cluster/command_error.h"
#include "tessera/v1/agent_link.grpc.pb.h"
#include "tests/support/attack_calls.h"

namespace tessera::support {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kPieceOfMemory = std::size_t{4} << 20;
// A statement of who somebody is has at most so many bytes before or after the key in it.
constexpr std::size_t kAroundAKey = net::kMaxCredentialBytes;
// A larger one is reserved rather than used, as a sanitizer's shadow is.
constexpr std::uint64_t kLargestMapping = std::uint64_t{1} << 30;

struct Mapping {
  std::uint64_t begin = 0, end = 0;
};

std::vector<Mapping> WritableMappings(std::int64_t pid) {
  std::vector<Mapping> mappings;
  std::ifstream maps(fmt::format("/proc/{}/maps", pid));
  for (std::string line; std::getline(maps, line);) {
    Mapping mapping;
    char dash = 0;
    std::string rights;
    std::istringstream(line) >> std::hex >> mapping.begin >> dash >> mapping.end >> rights;
    if (rights.starts_with("rw") && mapping.end - mapping.begin <= kLargestMapping) mappings.push_back(mapping);
  }
  return mappings;
}

// Each place in the mapping that has these bytes, with what stands around it; a place may come twice.
void Search(int memory, const Mapping& mapping, Bytes wanted, const std::function<void(Bytes, std::size_t)>& found) {
  std::vector<std::uint8_t> piece;
  for (std::uint64_t at = mapping.begin; at < mapping.end; at += kPieceOfMemory) {
    const std::uint64_t begin = std::max(mapping.begin, at - std::min<std::uint64_t>(at, kAroundAKey));
    const std::uint64_t end = std::min<std::uint64_t>(mapping.end, at + kPieceOfMemory + kAroundAKey);
    piece.resize(end - begin);
    const ssize_t got = pread(memory, piece.data(), piece.size(), static_cast<off_t>(begin));
    if (got <= 0) continue;  // no page is there
    piece.resize(static_cast<std::size_t>(got));
    const std::string_view text = AsText(piece);
    for (std::size_t hit = text.find(AsText(wanted)); hit != std::string_view::npos;
         hit = text.find(AsText(wanted), hit + 1)) {
      found(piece, hit);
    }
  }
}

// The key whose public half stands there, if its seed stands before it, as libsodium keeps the two.
std::optional<net::SigningKey> KeyAt(Bytes memory, std::size_t at, const net::VerificationKey& wanted) {
  if (at < net::kKeyBytes) return std::nullopt;
  net::Seed seed;
  std::memcpy(seed.data(), memory.data() + at - net::kKeyBytes, net::kKeyBytes);
  const net::SigningKey key(seed);
  if (key.verification_key() != wanted) return std::nullopt;
  return key;
}

// The statement of who has the key that stands there, if it is one.
std::vector<std::uint8_t> CertificateAt(Bytes memory, std::size_t at, const v1::WorkerIdentity& worker,
                                        const net::VerificationKey& instance_key) {
  const std::size_t size = net::WorkerCertificateBytes(worker.instance_id().size());
  const std::size_t before = size - net::kKeyBytes - sizeof(net::Signature);
  if (at < before || memory.size() < at - before + size) return {};
  const Bytes bytes = memory.subspan(at - before, size);
  const auto read = net::ReadWorkerCertificate(bytes, worker.instance_id(), instance_key);
  if (!read.ok() || read->region != RegionId(worker.region())) return {};
  return {bytes.begin(), bytes.end()};
}

v1::LinkHello HelloOf(const RegionKeys& keys) {
  v1::LinkHello hello;
  hello.set_region(keys.region.value());
  hello.set_incarnation(keys.incarnation.value());
  hello.set_rules(region::RulesOf(region::RegionSettings()));
  return hello;
}

Knock KnockAt(const v1::RegionStatus& status, bool at_link_port) {
  const v1::RegionAddress& address = status.report().address();
  return {.host = address.host(),
          .port = static_cast<std::uint16_t>(at_link_port ? address.link_port() : address.game_port()),
          .region = RegionId(status.region())};
}

// A region whose worker has just begun has no ports yet, at which anybody could knock.
bool Listens(const v1::RegionStatus& status) {
  const v1::RegionAddress& address = status.report().address();
  return address.link_port() != 0 && address.game_port() != 0;
}

}  // namespace

absl::StatusOr<RegionKeys> TakeRegionKeys(const v1::WorkerReport& report, const net::VerificationKey& instance_key) {
  const v1::WorkerIdentity& worker = report.identity();
  const auto wanted = net::VerificationKeyFrom(report.public_key(), "public_key");
  if (!wanted.ok()) return wanted.status();
  const std::string path = fmt::format("/proc/{}/mem", worker.pid());
  const int memory = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (memory < 0) return absl::PermissionDeniedError(absl::StrCat(path, ": ", std::strerror(errno)));
  std::optional<net::SigningKey> key;
  std::vector<std::uint8_t> certificate;
  for (const Mapping& mapping : WritableMappings(worker.pid())) {
    if (key && !certificate.empty()) break;
    Search(memory, mapping, *wanted, [&](Bytes around, std::size_t at) {
      if (!key) key = KeyAt(around, at, *wanted);
      if (certificate.empty()) certificate = CertificateAt(around, at, worker, instance_key);
    });
  }
  close(memory);
  if (!key || certificate.empty()) {
    return absl::NotFoundError(
        absl::StrCat(path, ": no ", key ? "certificate" : "key", " of region ", worker.region()));
  }
  return RegionKeys{.region = RegionId(worker.region()),
                    .incarnation = Incarnation(worker.incarnation()),
                    .credentials = {.instance_id = worker.instance_id(),
                                    .statement = std::move(certificate),
                                    .key = *key,
                                    .instance_key = instance_key}};
}

net::VerificationKey InstanceKeyOf(const std::string& control, const std::string& instance) {
  client::JoinCall watch{.instance_id = instance, .player_name = {}, .ticket = {}, .returning = {}, .watch = true};
  watch.deadline = kAttackPatience;
  return local::OrThrow(client::JoinInstance(control, watch)).credentials.instance_key;
}

std::vector<Knock> LinkKnocks(const std::vector<RegionKeys>& keys, const Regions& regions) {
  std::vector<Knock> knocks;
  for (const RegionKeys& held : keys) {
    for (const v1::RegionStatus& status : regions) {
      if (RegionId(status.region()) <= held.region || !Listens(status)) continue;
      knocks.push_back(KnockAt(status, true));
      knocks.back().credentials = held.credentials;
      knocks.back().hello = HelloOf(held);
    }
  }
  return knocks;
}

std::vector<Knock> ForgedKnocks(const std::vector<RegionKeys>& keys, const Regions& regions) {
  std::vector<Knock> knocks;
  for (const RegionKeys& held : keys) {
    RegionKeys next = held;
    next.region = RegionId(held.region.value() + 1);
    next.incarnation = Incarnation(held.incarnation.value() + 1);
    next.credentials.statement = net::Sign(net::WorkerCertificate{.instance_id = held.credentials.instance_id,
                                                                  .region = next.region,
                                                                  .incarnation = next.incarnation,
                                                                  .key = held.credentials.key.verification_key()},
                                           held.credentials.key);
    for (const v1::RegionStatus& status : regions) {
      if (!Listens(status)) continue;
      knocks.push_back(KnockAt(status, true));
      knocks.back().credentials = next.credentials;
      knocks.back().hello = HelloOf(next);
      knocks.push_back(KnockAt(status, false));
      knocks.back().credentials = held.credentials;
      knocks.back().credentials.statement =
          net::Sign(net::PlayerCredential{.instance_id = held.credentials.instance_id,
                                          .player = PlayerNumber(1),
                                          .generation = net::Generation(1),
                                          .key = held.credentials.key.verification_key()},
                    held.credentials.key);
    }
  }
  return knocks;
}

absl::Status FetchSceneByIdentity(const std::string& control, const std::string& identity,
                                  const std::string& scene_hash) {
  agent::HostIdentity host;
  if (!google::protobuf::util::JsonStringToMessage(identity, &host).ok()) {
    throw local::CommandError("no identity of a host: " + identity);
  }
  v1::FetchSceneRequest request;
  request.set_scene_hash(scene_hash);
  request.set_host_id(host.host_id());
  request.set_host_secret(host.host_secret());
  const auto stub = v1::AgentLinkService::NewStub(DialAlone(
      control,
      {.authority = host.authority(), .certificate = host.certificate(), .key = host.key(), .bearer_token = {}}));
  v1::FetchSceneResponse response;
  grpc::ClientContext context;
  context.set_deadline(Soon());
  const grpc::Status status = stub->FetchScene(&context, request, &response);
  return {static_cast<absl::StatusCode>(status.error_code()), status.error_message()};
}

}  // namespace tessera::support
