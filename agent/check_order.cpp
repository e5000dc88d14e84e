// Names of workers, and what an agent takes of an order for one that it is to start.
#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "agent/release_programs.h"
#include "agent/supervisor.h"
#include "core/game/native_name.h"
#include "core/world/limits.h"

namespace tessera::agent {
namespace {

constexpr std::size_t kMaxInstanceId = 64;  // becomes part of a file name
constexpr std::size_t kHashDigits = 64;

bool IsHex(char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); }
bool IsIdCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.';
}

bool IsHash(const std::string& text) {
  return text.size() == kHashDigits && std::all_of(text.begin(), text.end(), IsHex);
}

}  // namespace

std::string WorkerKey::ToString() const { return absl::StrCat(instance_id, "/", region, "#", incarnation); }

WorkerKey KeyOf(const v1::WorkerIdentity& identity) {
  return {identity.instance_id(), identity.region(), identity.incarnation()};
}

v1::WorkerIdentity IdentityOf(const WorkerKey& key) {
  v1::WorkerIdentity identity;
  identity.set_instance_id(key.instance_id);
  identity.set_region(key.region);
  identity.set_incarnation(key.incarnation);
  return identity;
}

std::string StateFolderOf(const std::string& folder, const WorkerKey& key) {
  return absl::StrCat(folder, "/", key.instance_id, "-", key.region, "-", key.incarnation);
}

absl::Status CheckSpeaker(const v1::WorkerIdentity& says, pid_t peer, std::int64_t pid) {
  const std::string worker = KeyOf(says).ToString();
  if (pid == 0 || says.pid() != pid) {
    return absl::NotFoundError(absl::StrCat("no worker ", worker, " with pid ", says.pid(), " belongs to this agent"));
  }
  if (peer != static_cast<pid_t>(pid)) {
    return absl::NotFoundError(absl::StrCat("process ", peer, " is not worker ", worker, ", which has pid ", pid));
  }
  return absl::OkStatus();
}

bool IsInstanceId(const std::string& id) {
  return !id.empty() && id.size() <= kMaxInstanceId && id[0] != '.' && id[0] != '-' &&
         std::all_of(id.begin(), id.end(), IsIdCharacter);
}

absl::Status CheckOrder(const v1::WorkerOrder& order) {
  if (!IsInstanceId(order.instance_id())) {
    return absl::InvalidArgumentError("order: instance_id must be 1 to 64 letters, digits, '-', '_' or '.'");
  }
  if (order.region() < 1 || order.region() > kMaxRegions) {
    return absl::InvalidArgumentError(
        absl::StrCat("order: region must be from 1 to ", kMaxRegions, ", got ", order.region()));
  }
  if (order.incarnation() == 0) return absl::InvalidArgumentError("order: incarnation must not be 0");
  if (!IsHash(order.scene_hash())) {
    return absl::InvalidArgumentError("order: scene_hash must be 64 hexadecimal digits");
  }
  if (!order.release().empty() && !IsReleaseName(order.release())) {
    return absl::InvalidArgumentError("order: release must be three numbers, as 0.1.0");
  }
  if (!order.game_hash().empty() && !IsHash(order.game_hash())) {
    return absl::InvalidArgumentError("order: game_hash must be 64 hexadecimal digits");
  }
  if (order.game_native()) {
    if (order.game_hash().empty()) return absl::InvalidArgumentError("order: game_hash is missing");
    if (absl::Status name = game::CheckModuleName(order.game_name()); !name.ok()) {
      return absl::InvalidArgumentError(absl::StrCat("order: ", name.message()));
    }
  }
  if (!order.movement_name().empty()) {
    if (!IsHash(order.movement_hash())) {
      return absl::InvalidArgumentError("order: movement_hash must be 64 hexadecimal digits");
    }
    if (absl::Status name = game::CheckModuleName(order.movement_name()); !name.ok()) {
      return absl::InvalidArgumentError(absl::StrCat("order: movement_name: ", name.message()));
    }
  }
  if (order.has_next_game() && !IsHash(order.next_game().hash())) {
    return absl::InvalidArgumentError("order: next_game.hash must be 64 hexadecimal digits");
  }
  return absl::OkStatus();
}

}  // namespace tessera::agent
