#include "local_cluster/connection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host/temporary_folder.h"

namespace tessera::local {
namespace {

using testing::HasSubstr;

std::string ErrorOf(Connection& connection) {
  try {
    connection.Call("host list", connection.hosts(), &v1::HostService::Stub::ListHosts, v1::ListHostsRequest());
  } catch (const CommandError& error) {
    return error.what();
  }
  return "none";
}

// A control plane that cannot write its store.
class FullDisk final : public v1::HostService::Service {
  grpc::Status ListHosts(grpc::ServerContext*, const v1::ListHostsRequest*, v1::ListHostsResponse*) override {
    return {grpc::StatusCode::UNAVAILABLE, "store: database or disk is full"};
  }
};

TEST(ConnectionTest, AControlPlaneThatAnswersUnavailableIsQuoted) {
  FullDisk service;
  grpc::ServerBuilder builder;
  const host::TemporaryFolder folder;
  const std::string address = "unix:" + folder.path() + "/control.sock";
  builder.AddListeningPort(address, grpc::InsecureServerCredentials());
  builder.RegisterService(&service);
  const auto server = builder.BuildAndStart();
  ASSERT_NE(server, nullptr);
  Connection connection(address);
  EXPECT_EQ(ErrorOf(connection), "host list: store: database or disk is full (UNAVAILABLE)");
}

TEST(ConnectionTest, WhereNobodyAnswersTheAddressIsNamed) {
  Connection connection(std::string("unix:/nowhere/control.sock"));
  EXPECT_THAT(ErrorOf(connection), HasSubstr("no control plane answers at unix:/nowhere/control.sock"));
}

TEST(ConnectionTest, AnAddressWithoutAnybodyToTrustIsRefusedBeforeAWordIsSent) {
  const auto error_of = [](const std::string& address) -> std::string {
    try {
      Connection connection(address);
    } catch (const CommandError& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_THAT(error_of("127.0.0.1:7700"),
              HasSubstr("--control 127.0.0.1:7700: nothing says which cluster is to answer"));
  EXPECT_THAT(error_of("nowhere"), HasSubstr("--control \"nowhere\" is not of the form HOST:PORT"));
  EXPECT_THAT(error_of("127.0.0.1:1#" + std::string(64, 'a')), HasSubstr("no control plane answers by TLS"));
}

}  // namespace
}  // namespace tessera::local
