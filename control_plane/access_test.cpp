#include "control_plane/access.h"

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "tessera/v1/agent_link.pb.h"
#include "tessera/v1/host.pb.h"
#include "tessera/v1/instance.pb.h"
#include "tessera/v1/session.pb.h"
#include "tessera/v1/visuals.pb.h"

namespace tessera::control {
namespace {

// Every method of every service that the control plane serves.
std::vector<const google::protobuf::MethodDescriptor*> AllDescriptors() {
  std::vector<const google::protobuf::MethodDescriptor*> all;
  for (const google::protobuf::FileDescriptor* file :
       {v1::AccessToken::descriptor()->file(), v1::AgentHello::descriptor()->file(), v1::Host::descriptor()->file(),
        v1::Instance::descriptor()->file(), v1::JoinInstanceRequest::descriptor()->file(),
        v1::PutVisualRequest::descriptor()->file()}) {
    for (int i = 0; i < file->service_count(); ++i) {
      for (int j = 0; j < file->service(i)->method_count(); ++j) {
        all.push_back(file->service(i)->method(j));
      }
    }
  }
  return all;
}
std::string PathOf(const google::protobuf::MethodDescriptor& method) {
  return absl::StrCat("/", method.service()->full_name(), "/", method.name());
}
std::vector<std::string> AllMethods() {
  std::vector<std::string> all;
  for (const google::protobuf::MethodDescriptor* method : AllDescriptors()) all.push_back(PathOf(*method));
  return all;
}

Caller At(Door door, v1::Role role = v1::ROLE_UNSPECIFIED) {
  return {
      .door = door, .role = role, .token = role == v1::ROLE_UNSPECIFIED ? "" : "ada", .instances = {}, .host_id = {}};
}
Caller HostAt(Door door) { return {.door = door, .role = {}, .token = {}, .instances = {}, .host_id = "host-1"}; }
bool Reads(const std::string& method) {
  const std::string name = method.substr(method.rfind('/') + 1);
  return absl::StartsWith(name, "Get") || absl::StartsWith(name, "List") || absl::StartsWith(name, "Watch");
}

bool HasAnyEnding(const std::string& method, std::initializer_list<const char*> endings) {
  return std::any_of(endings.begin(), endings.end(),
                     [&method](const char* ending) { return absl::EndsWith(method, ending); });
}

constexpr char kHealth[] = "/grpc.health.v1.Health/Check";

TEST(AccessTest, AStrangerCallsNothing) {
  ASSERT_GT(AllMethods().size(), 35u);
  for (const std::string& method : AllMethods()) {
    EXPECT_FALSE(CheckAccess(At(Door::kOperators), method).ok()) << method;
  }
  EXPECT_FALSE(CheckAccess(At(Door::kOperators), kHealth).ok());
  EXPECT_TRUE(CheckAccess(At(Door::kOperators, v1::ROLE_VIEWER), kHealth).ok());
  EXPECT_TRUE(CheckAccess(At(Door::kPlayers), kHealth).ok());
  EXPECT_TRUE(CheckAccess(At(Door::kPlayers), "/grpc.health.v1.Health/Watch").ok());
}

TEST(AccessTest, AJoinTokenAttachesAndDoesNothingElse) {
  Caller caller = At(Door::kOperators);
  caller.may_join = true;
  for (const std::string& method : AllMethods()) {
    EXPECT_EQ(CheckAccess(caller, method).ok(), absl::EndsWith(method, "/Attach")) << method;
  }
}

TEST(AccessTest, AViewerReads) {
  for (const std::string& method : AllMethods()) {
    if (absl::StrContains(method, "AgentLink")) continue;
    const bool session = absl::StrContains(method, "SessionService");
    // Tokens, issuers of tickets and bans are none of a viewer's business.
    const bool tokens = HasAnyEnding(method, {"/ListTokens", "/ListIssuers", "/ListBans"});
    EXPECT_EQ(CheckAccess(At(Door::kOperators, v1::ROLE_VIEWER), method).ok(), session || (Reads(method) && !tokens))
        << method;
  }
}

TEST(AccessTest, AnOperatorChangesWorldsAndNoHostsOrTokens) {
  for (const std::string& method : AllMethods()) {
    if (absl::StrContains(method, "AgentLink")) continue;
    const bool worlds = absl::StrContains(method, "InstanceService") || absl::StrContains(method, "SessionService") ||
                        absl::StrContains(method, "VisualService");
    const bool tokens = HasAnyEnding(method, {"/ListTokens", "/ListIssuers"});
    EXPECT_EQ(CheckAccess(At(Door::kOperators, v1::ROLE_OPERATOR), method).ok(), worlds || (Reads(method) && !tokens))
        << method;
  }
}

TEST(AccessTest, AnAdministratorCallsAllButWhatHostsCall) {
  for (const std::string& method : AllMethods()) {
    const bool host = absl::StrContains(method, "AgentLink");
    const bool init = absl::EndsWith(method, "/InitCluster");  // at the socket alone
    EXPECT_EQ(CheckAccess(At(Door::kOperators, v1::ROLE_ADMINISTRATOR), method).ok(), !host && !init) << method;
  }
}

TEST(AccessTest, AHostCallsWhatHostsCall) {
  for (const std::string& method : AllMethods()) {
    EXPECT_EQ(CheckAccess(HostAt(Door::kOperators), method).ok(), absl::StrContains(method, "AgentLink")) << method;
  }
}

TEST(AccessTest, AtThePlayersDoorOneJoinsAndSeesWhatThereIsToJoin) {
  for (const std::string& method : AllMethods()) {
    const bool served = absl::StrContains(method, "SessionService") || absl::EndsWith(method, "/ListInstances") ||
                        absl::EndsWith(method, "/GetInstance");
    EXPECT_EQ(CheckAccess(At(Door::kPlayers), method).ok(), served) << method;
    // Whatever else somebody has there, it opens nothing.
    EXPECT_EQ(CheckAccess(At(Door::kPlayers, v1::ROLE_ADMINISTRATOR), method).ok(), served) << method;
    EXPECT_EQ(CheckAccess(HostAt(Door::kPlayers), method).ok(), served) << method;
  }
}

TEST(AccessTest, WhatTheTableLacksIsAnAdministrators) {
  EXPECT_FALSE(CheckAccess(At(Door::kOperators, v1::ROLE_OPERATOR), "/tessera.v2.New/Method").ok());
  EXPECT_TRUE(CheckAccess(At(Door::kOperators, v1::ROLE_ADMINISTRATOR), "/tessera.v2.New/Method").ok());
  EXPECT_FALSE(CheckAccess(At(Door::kPlayers), "/tessera.v2.New/Method").ok());
  EXPECT_FALSE(CheckAccess(At(Door::kOperators), "").ok());
}

TEST(AccessTest, ATokenForSomeInstancesCallsWhatNamesOneAndSeesItsOwnInLists) {
  for (const google::protobuf::MethodDescriptor* method : AllDescriptors()) {
    const std::string path = PathOf(*method);
    if (absl::StrContains(path, "AgentLink")) continue;
    const google::protobuf::Descriptor& request = *method->input_type();
    const bool about_instances =
        absl::StrContains(path, "InstanceService") || absl::StrContains(path, "SessionService");
    const bool names_one = about_instances && (request.FindFieldByName("id") != nullptr ||
                                               request.FindFieldByName("instance_id") != nullptr);
    const bool filtered = HasAnyEnding(path, {"/ListInstances", "/GetScene", "/StreamScene", "/GetVisual"});
    const bool public_key = absl::EndsWith(path, "/GetAuthority");
    Caller caller = At(Door::kOperators, v1::ROLE_OPERATOR);
    caller.instances = "inst-7";
    EXPECT_EQ(CheckAccess(caller, path).ok(), names_one || filtered || public_key) << path;
  }
  Caller viewer = At(Door::kOperators, v1::ROLE_VIEWER);
  viewer.instances = "inst-7";
  EXPECT_FALSE(CheckAccess(viewer, "/tessera.v1.InstanceService/DeleteInstance").ok());
  EXPECT_EQ(CheckAccess(viewer, "/tessera.v1.HostService/ListHosts").message(),
            "token ada is for the instances inst-7; this call concerns the whole cluster");
}

TEST(AccessTest, WhichInstancesATokenIsFor) {
  struct Row {
    const char *prefix, *id;
    bool is_for;
  };
  for (const Row& row : {
           Row{"", "inst-7", true},
           Row{"", "", true},
           Row{"inst-", "inst-7", true},
           Row{"inst-7", "inst-7", true},
           Row{"inst-7", "inst-70", false},
           Row{"inst-7", "inst-77", false},
           Row{"inst-7", "inst-6", false},
           Row{"inst-7", "inst-", false},
           Row{"inst-7", "", false},
           Row{"inst-7", "INST-7", false},
           Row{"inst-7", "inst-7-b", true},
           Row{"arena-", "arena-eu", true},
           Row{"arena-", "arenas", false},
       }) {
    EXPECT_EQ(IsFor(row.prefix, row.id), row.is_for) << row.prefix << " " << row.id;
    Caller caller = At(Door::kOperators, v1::ROLE_OPERATOR);
    caller.instances = row.prefix;
    EXPECT_EQ(CheckInstance(caller, row.id).ok(), row.is_for) << row.prefix << " " << row.id;
  }
  Caller caller = At(Door::kOperators, v1::ROLE_VIEWER);
  caller.instances = "inst-7";
  EXPECT_EQ(CheckInstance(caller, "inst-8").message(), "token ada is for the instances inst-7 alone");
  // Revoked between the door and the method: nobody, whom no prefix keeps within bounds.
  EXPECT_EQ(CheckInstance(At(Door::kOperators), "inst-8").code(), absl::StatusCode::kUnauthenticated);
  EXPECT_FALSE(HasAllInstances(At(Door::kOperators)));
  EXPECT_TRUE(CheckInstance(At(Door::kPlayers), "inst-8").ok());
  EXPECT_TRUE(CheckInstance(At(Door::kSocket), "inst-8").ok());
}

TEST(AccessTest, TheFirstAdministratorIsMadeAtTheSocketAlone) {
  const std::string init = "/tessera.v1.AccessService/InitCluster";
  EXPECT_TRUE(CheckAccess(At(Door::kSocket, v1::ROLE_ADMINISTRATOR), init).ok());
  for (const Door door : {Door::kOperators, Door::kPlayers}) {
    for (int role = v1::ROLE_UNSPECIFIED; role <= v1::ROLE_ADMINISTRATOR; ++role) {
      EXPECT_EQ(CheckAccess(At(door, static_cast<v1::Role>(role)), init).code(), absl::StatusCode::kPermissionDenied);
    }
    EXPECT_FALSE(CheckAccess(HostAt(door), init).ok());
  }
}

TEST(AccessTest, ARefusalSaysWhatIsMissing) {
  const std::string add = "/tessera.v1.HostService/AddHost";
  const absl::Status none = CheckAccess(At(Door::kOperators), add);
  EXPECT_EQ(none.code(), absl::StatusCode::kUnauthenticated);
  const absl::Status little = CheckAccess(At(Door::kOperators, v1::ROLE_VIEWER), add);
  EXPECT_EQ(little.code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(little.message(), "token ada is a viewer's; this call needs an administrator's");
}

}  // namespace
}  // namespace tessera::control
