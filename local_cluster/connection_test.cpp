#include "local_cluster/connection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const auto server = builder.BuildAndStart();
  ASSERT_NE(port, 0);
  Connection connection("127.0.0.1:" + std::to_string(port));
  EXPECT_EQ(ErrorOf(connection), "host list: store: database or disk is full (UNAVAILABLE)");
}

TEST(ConnectionTest, WhereNobodyAnswersTheAddressIsNamed) {
  Connection connection("127.0.0.1:1");
  EXPECT_THAT(ErrorOf(connection), HasSubstr("no control plane answers at 127.0.0.1:1"));
}

}  // namespace
}  // namespace tessera::local
