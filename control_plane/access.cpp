#include "control_plane/access.h"

#include <algorithm>
#include <array>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

namespace tessera::control {
namespace {

enum class Need : std::uint8_t { kViewer, kOperator, kAdministrator, kHost, kHostOrJoinToken, kSocket };
// The tokens that may call it: those for some instances alone, too, or only those for the whole cluster.
enum class For : std::uint8_t { kCluster, kInstances };

struct Method {
  std::string_view path;
  Need need;
  For whose = For::kCluster;
  bool players = false;  // served at the players' door, too
};

// At the operators' door every method needs a proof in the call's headers: a request is read whole before its method
// sees it, up to the door's limit, so nobody may call anything who has shown nothing.
constexpr std::array kMethods{
    Method{"/grpc.health.v1.Health/Check", Need::kViewer, For::kInstances, true},
    // A channel to several control planes asks each of them by it who leads.
    Method{"/grpc.health.v1.Health/Watch", Need::kViewer, For::kInstances, true},
    Method{"/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", Need::kViewer, For::kInstances},
    Method{"/tessera.v1.AccessService/AddIssuer", Need::kAdministrator},
    Method{"/tessera.v1.AccessService/BackupCluster", Need::kAdministrator},
    Method{"/tessera.v1.AccessService/CreateToken", Need::kAdministrator},
    Method{"/tessera.v1.AccessService/GetAuthority", Need::kViewer, For::kInstances},
    Method{"/tessera.v1.AccessService/InitCluster", Need::kSocket},
    Method{"/tessera.v1.AccessService/ListIssuers", Need::kAdministrator},
    Method{"/tessera.v1.AccessService/ListTokens", Need::kAdministrator},
    Method{"/tessera.v1.AccessService/RemoveIssuer", Need::kAdministrator},
    Method{"/tessera.v1.AccessService/RevokeToken", Need::kAdministrator},
    Method{"/tessera.v1.AgentLinkService/Attach", Need::kHostOrJoinToken},
    Method{"/tessera.v1.AgentLinkService/FetchGame", Need::kHost},
    Method{"/tessera.v1.AgentLinkService/FetchScene", Need::kHost},
    Method{"/tessera.v1.AgentLinkService/FetchState", Need::kHost},
    Method{"/tessera.v1.AgentLinkService/StreamScene", Need::kHost},
    Method{"/tessera.v1.AgentLinkService/UploadCheckpoint", Need::kHost},
    Method{"/tessera.v1.HostService/AddHost", Need::kAdministrator},
    Method{"/tessera.v1.HostService/DrainHost", Need::kAdministrator},
    Method{"/tessera.v1.HostService/GetHost", Need::kViewer},
    Method{"/tessera.v1.HostService/ListHosts", Need::kViewer},
    Method{"/tessera.v1.HostService/RemoveHost", Need::kAdministrator},
    Method{"/tessera.v1.InstanceService/BanPlayer", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/CheckpointInstance", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/CreateInstance", Need::kOperator},
    Method{"/tessera.v1.InstanceService/DeleteInstance", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/ExportCheckpoint", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/GetInstance", Need::kViewer, For::kInstances, true},
    Method{"/tessera.v1.InstanceService/ImportCheckpoint", Need::kOperator},
    Method{"/tessera.v1.InstanceService/KickPlayer", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/ListBans", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/ListCheckpoints", Need::kViewer, For::kInstances},
    Method{"/tessera.v1.InstanceService/ListGameLines", Need::kViewer, For::kInstances},
    Method{"/tessera.v1.InstanceService/ListInstances", Need::kViewer, For::kInstances, true},
    Method{"/tessera.v1.InstanceService/PauseInstance", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/PutScene", Need::kOperator},
    Method{"/tessera.v1.InstanceService/RestartWorkers", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/RestoreInstance", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/ResumeInstance", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/ScaleInstance", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/SendToGame", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/SetGame", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/SetPace", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/SetProperty", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/UnbanPlayer", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/UpgradeInstance", Need::kOperator, For::kInstances},
    Method{"/tessera.v1.InstanceService/WatchGameEvents", Need::kViewer, For::kInstances},
    Method{"/tessera.v1.InstanceService/WatchInstance", Need::kViewer, For::kInstances},
    Method{"/tessera.v1.SessionService/GetScene", Need::kViewer, For::kInstances, true},
    Method{"/tessera.v1.SessionService/JoinInstance", Need::kViewer, For::kInstances,
           true},  // a viewer's token joins as a viewer only
    Method{"/tessera.v1.SessionService/LeaveInstance", Need::kViewer, For::kInstances, true},
    Method{"/tessera.v1.SessionService/StreamScene", Need::kViewer, For::kInstances, true},
    Method{"/tessera.v1.VisualService/FindMissingVisuals", Need::kOperator},
    Method{"/tessera.v1.VisualService/GetVisual", Need::kViewer, For::kInstances},
    Method{"/tessera.v1.VisualService/PutVisual", Need::kOperator},
};
static_assert(std::is_sorted(kMethods.begin(), kMethods.end(),
                             [](const Method& a, const Method& b) { return a.path < b.path; }));

Method MethodAt(std::string_view path) {
  const auto found =
      std::lower_bound(kMethods.begin(), kMethods.end(), path,
                       [](const Method& method, std::string_view wanted) { return method.path < wanted; });
  return found != kMethods.end() && found->path == path ? *found : Method{path, Need::kAdministrator};
}

v1::Role RoleFor(Need need) {
  switch (need) {
    case Need::kHost:
    case Need::kHostOrJoinToken:
    case Need::kSocket:
      return v1::ROLE_UNSPECIFIED;
    case Need::kViewer:
      return v1::ROLE_VIEWER;
    case Need::kOperator:
      return v1::ROLE_OPERATOR;
    case Need::kAdministrator:
      return v1::ROLE_ADMINISTRATOR;
  }
  return v1::ROLE_ADMINISTRATOR;
}

// "ROLE_VIEWER" is "viewer's".
std::string Possessive(v1::Role role) {
  return absl::StrCat(absl::AsciiStrToLower(v1::Role_Name(role).substr(sizeof "ROLE_" - 1)), "'s");
}

absl::Status CheckOperators(const Caller& caller, const Method& method) {
  if (method.need == Need::kHostOrJoinToken) {
    return caller.may_join || !caller.host_id.empty() ? absl::OkStatus()
                                                      : absl::UnauthenticatedError(
                                                            "a host's certificate or its join token is needed; an "
                                                            "agent of an earlier release shows its token too late");
  }
  if (method.need == Need::kHost) {
    return caller.host_id.empty() ? absl::UnauthenticatedError("a host's certificate is needed") : absl::OkStatus();
  }
  if (method.need == Need::kSocket) {
    return absl::PermissionDeniedError("this call is served at the control plane's socket alone, on its machine");
  }
  const v1::Role needed = RoleFor(method.need);
  if (caller.role >= needed) {
    if (caller.instances.empty() || method.whose == For::kInstances) return absl::OkStatus();
    return absl::PermissionDeniedError(absl::StrCat("token ", caller.token, " is for the instances ", caller.instances,
                                                    "; this call concerns the whole cluster"));
  }
  if (caller.role == v1::ROLE_UNSPECIFIED) {
    return absl::UnauthenticatedError("an access token is needed, one that stands and has not run out");
  }
  return absl::PermissionDeniedError(absl::StrCat("token ", caller.token, " is a ", Possessive(caller.role),
                                                  "; this call needs an ", Possessive(needed)));
}

}  // namespace

std::string Caller::Name() const {
  switch (door) {
    case Door::kSocket:
      return "local";
    case Door::kPlayers:
      return "player";
    case Door::kOperators:
      break;
  }
  if (!token.empty()) return absl::StrCat("token/", token);
  return host_id.empty() ? "nobody" : host_id;
}

absl::Status CheckAccess(const Caller& caller, std::string_view method) {
  const Method found = MethodAt(method);
  switch (caller.door) {
    case Door::kSocket:
      return absl::OkStatus();
    case Door::kOperators:
      return CheckOperators(caller, found);
    case Door::kPlayers:
      return found.players ? absl::OkStatus()
                           : absl::PermissionDeniedError("the players' door does not serve this call");
  }
  return absl::PermissionDeniedError("unknown door");
}

bool IsFor(std::string_view prefix, std::string_view id) {
  if (!id.starts_with(prefix)) return false;
  const auto digit = [](char c) { return absl::ascii_isdigit(static_cast<unsigned char>(c)); };
  return prefix.empty() || id.size() == prefix.size() || !digit(prefix.back()) || !digit(id[prefix.size()]);
}

bool HasAllInstances(const Caller& caller) {
  return caller.door != Door::kOperators || (caller.role != v1::ROLE_UNSPECIFIED && caller.instances.empty());
}

absl::Status CheckInstance(const Caller& caller, std::string_view id) {
  if (HasAllInstances(caller)) return absl::OkStatus();
  if (caller.role == v1::ROLE_UNSPECIFIED) return absl::UnauthenticatedError("the access token stands no more");
  if (IsFor(caller.instances, id)) return absl::OkStatus();
  return absl::PermissionDeniedError(
      absl::StrCat("token ", caller.token, " is for the instances ", caller.instances, " alone"));
}

}  // namespace tessera::control
