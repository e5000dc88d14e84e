// DoorsTest: a control plane that serves its three doors, and those who knock at them.
#pragma once

#include <gtest/gtest.h>
#include <sodium.h>

#include <memory>
#include <string>
#include <utility>

#include "control_plane/grpc_server.h"
#include "control_plane/memory_store.h"
#include "control_plane/testing/loaded_plane.h"
#include "host/temporary_folder.h"
#include "tessera/v1/access.grpc.pb.h"
#include "tessera/v1/agent_link.grpc.pb.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tessera/v1/session.grpc.pb.h"
#include "trust/dial.h"

namespace tessera::control {

class DoorsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_GE(sodium_init(), 0);
    plane_ = LoadPlane(store_);
    ASSERT_NE(plane_, nullptr);
    auto authority = OpenAuthority(store_, folder_.path() + "/seal.key", SystemRandomBytes);
    ASSERT_TRUE(authority.ok()) << authority.status();
    authority_ = *authority;
    const GrpcDoors doors{
        .socket = folder_.path() + "/control.sock", .operators = "127.0.0.1:0", .players = "127.0.0.1:0"};
    auto server = GrpcServer::Start(doors, *std::move(authority), *plane_, metrics_);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
  }
  void TearDown() override {
    plane_->Stop();
    server_.reset();
    plane_.reset();
  }

  std::shared_ptr<grpc::Channel> Operators(const std::string& token = "") {
    return Dialled(server_->operators(),
                   {.authority = authority_.signer.certificate, .certificate = {}, .key = {}, .bearer_token = token});
  }
  std::shared_ptr<grpc::Channel> Players() { return Dialled(server_->players() + "#" + authority_.fingerprint, {}); }
  std::shared_ptr<grpc::Channel> Socket() { return Dialled(server_->socket(), {}); }
  static std::shared_ptr<grpc::Channel> Dialled(const std::string& address, const trust::Credentials& credentials) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    const auto channel = trust::Dial(address, credentials, arguments);
    EXPECT_TRUE(channel.ok()) << channel.status();
    return *channel;
  }

  std::string Token(const std::string& name, v1::Role role, const std::string& instances = "") {
    v1::CreateTokenRequest request;
    request.set_name(name);
    request.set_role(role);
    request.set_instances(instances);
    v1::CreateTokenResponse response;
    grpc::ClientContext context;
    EXPECT_TRUE(v1::AccessService::NewStub(Socket())->CreateToken(&context, request, &response).ok());
    return response.secret();
  }
  static grpc::Status AddHost(const std::shared_ptr<grpc::Channel>& channel, const std::string& name,
                              std::string* token = nullptr) {
    v1::AddHostRequest request;
    request.set_name(name);
    v1::AddHostResponse response;
    grpc::ClientContext context;
    const grpc::Status status = v1::HostService::NewStub(channel)->AddHost(&context, request, &response);
    if (token != nullptr) *token = response.join_token();
    return status;
  }
  static grpc::Status ListHosts(const std::shared_ptr<grpc::Channel>& channel) {
    v1::ListHostsResponse response;
    grpc::ClientContext context;
    return v1::HostService::NewStub(channel)->ListHosts(&context, {}, &response);
  }
  static grpc::Status Join(const std::shared_ptr<grpc::Channel>& channel, bool viewer) {
    v1::JoinInstanceRequest request;
    request.set_instance_id("inst-1");
    request.set_viewer(viewer);
    v1::JoinInstanceResponse response;
    grpc::ClientContext context;
    return v1::SessionService::NewStub(channel)->JoinInstance(&context, request, &response);
  }

  // The status with which the control plane answers an agent's hello; `admitted` is left alone unless it admits it.
  static grpc::Status Hello(const std::shared_ptr<grpc::Channel>& channel, const v1::AgentHello& hello,
                            v1::Admitted* admitted) {
    grpc::ClientContext context;
    const auto stream = v1::AgentLinkService::NewStub(channel)->Attach(&context);
    v1::AgentMessage message;
    *message.mutable_hello() = hello;
    stream->Write(message);
    v1::ControlMessage answer;
    if (stream->Read(&answer)) {
      if (admitted != nullptr) *admitted = answer.admitted();
      context.TryCancel();
      while (stream->Read(&answer)) {
      }
      (void)stream->Finish();
      return grpc::Status::OK;
    }
    return stream->Finish();
  }
  struct Host {
    std::string id, secret;
    trust::Credentials credentials;
  };
  // Joins by TLS, as an agent does.
  Host JoinHost(const std::string& name) {
    std::string token;
    EXPECT_TRUE(AddHost(Socket(), name, &token).ok());
    EXPECT_EQ(token.substr(token.find('.') + 1), authority_.fingerprint);
    return JoinWith(token.substr(0, token.find('.')));
  }
  Host JoinWith(const std::string& token) {
    Host host;
    host.credentials.key = *trust::MakeKey();
    v1::AgentHello hello = PlainHello();
    hello.set_join_token(token);
    hello.set_certificate_request(*trust::MakeRequest(host.credentials.key));
    v1::Admitted admitted;
    const grpc::Status status = Hello(Operators(token), hello, &admitted);
    EXPECT_TRUE(status.ok()) << status.error_message();
    host.id = admitted.host_id();
    host.secret = admitted.host_secret();
    host.credentials.certificate = admitted.certificate();
    host.credentials.authority = admitted.authority();
    return host;
  }
  static v1::AgentHello PlainHello() {
    v1::AgentHello hello;
    hello.set_advertise_address("127.0.0.1");
    hello.mutable_resources()->set_region_capacity(4);
    return hello;
  }
  static v1::AgentHello HelloOf(const Host& host) {
    v1::AgentHello hello = PlainHello();
    hello.set_host_id(host.id);
    hello.set_host_secret(host.secret);
    return hello;
  }
  grpc::Status FetchScene(const std::shared_ptr<grpc::Channel>& channel, const Host& as) {
    v1::FetchSceneRequest request;
    request.set_scene_hash("none");
    request.set_host_id(as.id);
    request.set_host_secret(as.secret);
    v1::FetchSceneResponse response;
    grpc::ClientContext context;
    return v1::AgentLinkService::NewStub(channel)->FetchScene(&context, request, &response);
  }

  const host::TemporaryFolder folder_;
  MemoryStore store_;
  ControlMetrics metrics_;
  Authority authority_;
  std::unique_ptr<ControlPlane> plane_;
  std::unique_ptr<GrpcServer> server_;
};

}  // namespace tessera::control
