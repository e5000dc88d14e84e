#include "control_plane/cluster/free_hosts.h"

#include <algorithm>
#include <map>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/cluster/hosts.h"
#include "control_plane/cluster/world_releases.h"
#include "control_plane/instance_record.h"
#include "control_plane/one_line.h"
#include "core/game/native_name.h"

namespace tessera::control {
namespace {

constexpr std::size_t kNamedHosts = 8;  // in an error; the others are counted

const v1::GameModule* ModuleOf(const HostEntry& host, const std::string& name) {
  const auto& modules = host.record.game_modules().modules();
  const auto found =
      std::find_if(modules.begin(), modules.end(), [&](const v1::GameModule& module) { return module.name() == name; });
  return found == modules.end() ? nullptr : &*found;
}

// Why no such region can run on the host; empty: it has the release's programs and the native game, or needs none.
std::string LackOf(const HostEntry& host, const RegionNeeds& needs) {
  if (!HasRelease(host.record, needs.release)) {
    return absl::StrCat("has release ", absl::StrJoin(ReleasesOf(host.record), ", "));
  }
  if (needs.module.empty()) return "";
  const v1::GameModule* module = ModuleOf(host, needs.module);
  if (module == nullptr) return "has no such game module";
  if (!module->failure().empty()) return module->failure();
  if (needs.movement && !module->movement()) return "it has no movement";
  if (!needs.movement && module->no_game()) return "it has a movement alone, and is no game";
  if (needs.build.empty() || module->hash() == needs.build) return "";
  return absl::StrCat("has build ", module->hash().substr(0, 8));
}

// "native:arena@1a2b3c4d and release 0.2.0": the needs that a host may lack.
std::string TextOf(const RegionNeeds& needs) {
  const std::string release = needs.release.empty() ? "" : "release " + needs.release;
  if (needs.module.empty()) return release;
  const std::string game = game::NativeGameText(needs.module, needs.build);
  return release.empty() ? game : absl::StrCat(game, " and ", release);
}

// "alpha (has no such game module), beta (has build 1a2b3c4d)", of those that take regions.
std::string LackingHosts(const ClusterState& state, const RegionNeeds& needs) {
  std::vector<std::string> lacking;
  for (const auto& [number, host] : state.hosts()) {
    if (StateOf(host) != v1::HOST_STATE_READY) continue;
    if (const std::string lack = LackOf(host, needs); !lack.empty()) {
      lacking.push_back(absl::StrCat(host.record.name(), " (", lack, ")"));
    }
  }
  const std::size_t more = lacking.size() > kNamedHosts ? lacking.size() - kNamedHosts : 0;
  lacking.resize(lacking.size() - more);
  return absl::StrCat(absl::StrJoin(lacking, ", "), more > 0 ? absl::StrCat(" and ", more, " more") : "");
}

std::vector<FreeHost> NotAvoided(std::vector<FreeHost> hosts) {
  std::erase_if(hosts, [](const FreeHost& host) { return host.avoided; });
  return hosts;
}

absl::Status NobodyHas(const ClusterState& state, const RegionNeeds& needs) {
  const std::string lacking = LackingHosts(state, needs);
  return absl::FailedPreconditionError(
      OneLine(absl::StrCat("no host that takes regions has ", TextOf(needs),
                           lacking.empty() ? "; no host is ready" : absl::StrCat(": ", lacking)),
              kMaxReasonBytes));
}

}  // namespace

RegionNeeds NeedsOf(const records::Instance& record) {
  RegionNeeds needs{.threads = RegionThreadsOf(record), .release = record.release()};
  if (record.game_native()) {
    needs.module = record.game_name();
    needs.build = record.game_hash();
  } else if (record.has_movement()) {
    needs.module = record.movement().name();
    needs.build = record.movement().hash();
    needs.movement = true;
  }
  return needs;
}

std::vector<FreeHost> FreeHosts(const ClusterState& state, const RegionNeeds& needs, const InstanceEntry* without) {
  std::vector<FreeHost> free;
  for (const auto& [number, host] : state.hosts()) {
    if (StateOf(host) != v1::HOST_STATE_READY || !LackOf(host, needs).empty()) continue;
    std::uint32_t taken = 0;
    for (const auto& [instance, index] : host.workers) {
      if (without != nullptr && instance == without->number) continue;
      taken += RegionThreadsOf(state.instances().at(instance).record);
    }
    const std::uint32_t capacity = CapacityOf(host);
    free.push_back({.id = host.record.id(),
                    .free = capacity > taken ? (capacity - taken) / needs.threads : 0,
                    .avoided = host.no_ports_until.count() != 0});
  }
  return free;
}

std::vector<FreeHost> HeardHosts(const ClusterState& state, const RegionNeeds& needs, const InstanceEntry* without,
                                 Steady silence, Now now) {
  std::vector<FreeHost> heard = FreeHosts(state, needs, without);
  std::erase_if(heard,
                [&](const FreeHost& host) { return now.steady - state.FindHost(host.id)->last_heard > silence; });
  return heard;
}

absl::StatusOr<PlacementPlan> PlaceAnew(const ClusterState& state, const PartitionMap& map, const RegionNeeds& needs,
                                        const InstanceEntry* without, Steady silence, Now now) {
  const std::vector<FreeHost> heard = HeardHosts(state, needs, without, silence, now);
  const std::vector<FreeHost> free = FreeHosts(state, needs, without);
  for (const auto& hosts : {NotAvoided(heard), NotAvoided(free), heard}) {
    if (auto placed = Place(map, hosts); placed.ok()) return placed;
  }
  if (free.empty() && !needs.module.empty()) return NobodyHas(state, needs);
  auto placed = Place(map, free);
  if (!placed.ok()) return NamingLackingHosts(state, needs, placed.status());
  return placed;
}

absl::Status NamingLackingHosts(const ClusterState& state, const RegionNeeds& needs, const absl::Status& status) {
  const std::string lacking = LackingHosts(state, needs);
  if (lacking.empty()) return status;
  return {status.code(),
          OneLine(absl::StrCat(status.message(), "; without ", TextOf(needs), ": ", lacking), kMaxReasonBytes)};
}

absl::StatusOr<std::string> BuildOfModule(const ClusterState& state, const RegionNeeds& needs) {
  const std::string& module = needs.module;
  const RegionNeeds any{.threads = 1, .module = module, .build = "", .movement = needs.movement};
  std::map<std::string, std::vector<std::string>> builds;  // with the names of the hosts
  for (const auto& [number, host] : state.hosts()) {
    if (StateOf(host) != v1::HOST_STATE_READY || !LackOf(host, any).empty()) continue;
    builds[ModuleOf(host, module)->hash()].push_back(host.record.name());
  }
  if (builds.empty()) return NobodyHas(state, any);
  if (builds.size() == 1) return builds.begin()->first;
  const std::string which = absl::StrJoin(builds, "; ", [](std::string* out, const auto& build) {
    absl::StrAppend(out, build.first, " on ", absl::StrJoin(build.second, ", "));
  });
  return absl::FailedPreconditionError(
      OneLine(absl::StrCat("hosts have different builds of native:", module, "; give one of them after '@': ", which),
              kMaxReasonBytes));
}

}  // namespace tessera::control
