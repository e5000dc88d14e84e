// Players who are gone without having left: what becomes of their bodies, by the instance's policy.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/cluster.h"

namespace tessera::control {
namespace {

// A host that is silent may well serve its players still: by what it told last.
std::set<std::uint32_t> Connected(const InstanceEntry& instance) {
  std::set<std::uint32_t> connected;
  for (const WorkerEntry& worker : instance.workers) {
    const auto& players = worker.report.connected_players();
    if (!worker.gone) connected.insert(players.begin(), players.end());
  }
  return connected;
}

}  // namespace

// Counted from when the last connection was seen; in a new life of the control plane, from its beginning.
std::optional<records::Instance> Cluster::NextLeavers(Moment now, InstanceEntry& instance) {
  const records::Instance& record = instance.record;
  const bool parks = record.leaver_policy() == v1::LEAVER_POLICY_PARK;
  if (!parks && record.leaver_policy() != v1::LEAVER_POLICY_REMOVE) return std::nullopt;
  const std::set<std::uint32_t> connected = Connected(instance);
  std::optional<records::Instance> next;
  for (int i = 0; i < record.players_size(); ++i) {
    const v1::Player& player = record.players(i);
    bool away = false;
    if (!player.left() && !connected.contains(player.number())) {
      const Steady since = instance.gone_since.try_emplace(player.number(), now.steady).first->second;
      away = player.parked() || now.steady - since >= std::chrono::milliseconds(record.leaver_grace_ms());
    } else {
      instance.gone_since.erase(player.number());
    }
    if (player.left() || away == (parks && player.parked())) continue;
    if (!next) next = record;
    v1::Player& changed = *next->mutable_players(i);
    if (parks) {
      changed.set_parked(away);
    } else {
      changed.set_left(true);
      instance.left[player.number()] = {last_revision_, now.steady};
    }
    effects_.log.push_back(absl::StrCat("player ",
                                        !parks ? "removed"
                                        : away ? "parked"
                                               : "back",
                                        " id=", record.id(), " player=", player.number()));
  }
  return next;
}

}  // namespace tessera::control
