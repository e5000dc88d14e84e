#include <vector>

#include "control_plane/access.h"

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "tessera/v1/agent_link.pb.h"
#include "tessera/v1/host.pb.h"
#include "tessera/v1/instance.pb.h"
#include "tessera/v1/session.pb.h"

namespace tessera::control {
namespace {

// Every method of every service that the control plane serves.
std::vector<std::string> AllMethods() {
  std::vector<std::string> all;
  for (const google::protobuf::FileDescriptor* file :
       {v1::AccessToken::descriptor()->file(), v1::AgentHello::descriptor()->file(), v1::Host::descriptor()->file(),
        v1::Instance::descriptor()->file(), v1::JoinInstanceRequest::descriptor()->file()}) {
    for (int i = 0; i < file->service_count(); ++i) {
      for (int j = 0; j < file->service(i)->method_count(); ++j) {
        all.push_back(absl::StrCat("/", file->service(i)->full_name(), "/", file->service(i)->method(j)->name()));
      }
    }
  }
  return all;
}

Caller At(Door door, v1::Role role = v1::ROLE_UNSPECIFIED) {
  return {.door = door, .role = role, .token = role == v1::ROLE_UNSPECIFIED ? "" : "ada", .host_id = {}};
}
Caller HostAt(Door door) { return {.door = door, .role = {}, .token = {}, .host_id = "host-1"}; }
bool Reads(const std::string& method) {
  const std::string name = method.substr(method.rfind('/') + 1);
  return absl::StartsWith(name, "Get") || absl::StartsWith(name, "List") || absl::StartsWith(name, "Watch");
}

TEST(AccessTest, AStrangerCallsNothingButAttach) {
  ASSERT_GT(AllMethods().size(), 35u);
  for (const std::string& method : AllMethods()) {
    const bool attach = absl::EndsWith(method, "/Attach");  // its first message must prove who it is
    EXPECT_EQ(CheckAccess(At(Door::kOperators), method).ok(), attach) << method;
  }
}

TEST(AccessTest, AViewerReads) {
  for (const std::string& method : AllMethods()) {
    if (absl::StrContains(method, "AgentLink")) continue;
    const bool session = absl::StrContains(method, "SessionService");
    const bool tokens = absl::EndsWith(method, "/ListTokens");
    EXPECT_EQ(CheckAccess(At(Door::kOperators, v1::ROLE_VIEWER), method).ok(), session || (Reads(method) && !tokens))
        << method;
  }
}

TEST(AccessTest, AnOperatorChangesWorldsAndNoHostsOrTokens) {
  for (const std::string& method : AllMethods()) {
    if (absl::StrContains(method, "AgentLink")) continue;
    const bool worlds = absl::StrContains(method, "InstanceService") || absl::StrContains(method, "SessionService");
    const bool tokens = absl::EndsWith(method, "/ListTokens");
    EXPECT_EQ(CheckAccess(At(Door::kOperators, v1::ROLE_OPERATOR), method).ok(), worlds || (Reads(method) && !tokens))
        << method;
  }
}

TEST(AccessTest, AnAdministratorCallsAllButWhatHostsCall) {
  for (const std::string& method : AllMethods()) {
    const bool host = absl::StrContains(method, "AgentLink") && !absl::EndsWith(method, "/Attach");
    EXPECT_EQ(CheckAccess(At(Door::kOperators, v1::ROLE_ADMINISTRATOR), method).ok(), !host) << method;
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
