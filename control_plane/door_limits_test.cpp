// Strangers at the doors of a real control plane.
#include "control_plane/door_limits.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "control_plane/doors_fixture.h"
#include "host/socket_address.h"
#include "tessera/v1/agent_link.grpc.pb.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "tessera/v1/session.grpc.pb.h"
#include "trust/dial.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

Caller At(Door door, const std::string& token = "") {
  return {.door = door, .role = {}, .token = token, .instances = {}, .host_id = {}};
}

TEST(CallSlotsTest, CountsByTokenAndByAddressAndForgetsWhoHasNone) {
  CallSlots slots;
  std::vector<std::unique_ptr<CallSlots::Slot>> held;
  for (int i = 0; i < kCallsOfAnAddress; ++i) {
    held.push_back(slots.Take(At(Door::kPlayers), "ipv4:192.0.2.7:" + std::to_string(5000 + i), "S/Join"));
    ASSERT_NE(held.back(), nullptr);
  }
  EXPECT_EQ(slots.Take(At(Door::kPlayers), "ipv4:192.0.2.7:9", "S/Join"), nullptr);
  EXPECT_NE(slots.Take(At(Door::kPlayers), "ipv4:192.0.2.8:9", "S/Join"), nullptr);
  EXPECT_NE(slots.Take(At(Door::kOperators, "ada"), "ipv4:192.0.2.7:9", "S/Get"), nullptr);
  EXPECT_NE(slots.Take(At(Door::kSocket), "unix:", "S/Get"), nullptr);
  EXPECT_EQ(slots.callers(), 1u);
  held.pop_back();
  EXPECT_NE(slots.Take(At(Door::kPlayers), "ipv4:192.0.2.7:9", "S/Join"), nullptr);
  held.clear();
  EXPECT_EQ(slots.callers(), 0u);
}

TEST(CallSlotsTest, ImportsOfOneCallerAreFew) {
  CallSlots slots;
  const auto import = [&](const char* token) {
    return slots.Take(At(Door::kOperators, token), "ipv4:192.0.2.7:9", "InstanceService/ImportCheckpoint");
  };
  const auto first = import("ada"), second = import("ada");
  ASSERT_NE(second, nullptr);
  EXPECT_EQ(import("ada"), nullptr);
  EXPECT_NE(import("bob"), nullptr);
  EXPECT_NE(slots.Take(At(Door::kOperators, "ada"), "ipv4:192.0.2.7:9", "S/Get"), nullptr);
}

class DoorLimitsTest : public DoorsTest {};

int Connect(const std::string& address) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(host::ParseSocketAddress(address, host::PortRule::kFrom1)->port);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  return fd;
}

TEST_F(DoorLimitsTest, AConnectionThatSaysNothingIsClosed) {
  constexpr int kPatience_ms = 60'000;  // gRPC's own limit is 120 s
  const std::array<int, 2> silent = {Connect(server_->operators()), Connect(server_->players())};
  for (const int fd : silent) {
    pollfd readable{.fd = fd, .events = POLLIN, .revents = 0};
    char byte = 0;
    EXPECT_EQ(poll(&readable, 1, kPatience_ms), 1);
    EXPECT_LE(recv(fd, &byte, 1, MSG_DONTWAIT), 0);
    close(fd);
  }
}

TEST_F(DoorLimitsTest, AnAddressWithAsManyConnectionsAsItMayHaveGetsNoMoreUntilItClosesSome) {
  std::vector<int> held;
  for (std::size_t i = 0; i < ConnectionLimits{}.from_address; ++i) held.push_back(Connect(server_->operators()));
  const auto ask = [this](bool wait_for_room) {
    grpc::ChannelArguments own;
    own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    const auto channel = trust::Dial(server_->operators() + "#" + authority_.fingerprint, {}, own);
    if (!channel.ok()) return grpc::StatusCode::UNAVAILABLE;
    grpc::ClientContext context;
    context.set_wait_for_ready(wait_for_room);
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    v1::ListHostsResponse response;
    return v1::HostService::NewStub(*channel)->ListHosts(&context, {}, &response).error_code();
  };
  EXPECT_EQ(ask(false), grpc::StatusCode::UNAVAILABLE) << "the address has none left";
  for (const int fd : held) close(fd);
  // It asks for a token now: who asks has been let in.
  grpc::StatusCode answered = grpc::StatusCode::UNAVAILABLE;
  const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (answered == grpc::StatusCode::UNAVAILABLE && std::chrono::steady_clock::now() < patience) answered = ask(true);
  EXPECT_EQ(answered, grpc::StatusCode::UNAUTHENTICATED);
}

TEST_F(DoorLimitsTest, ALongMessageOfAPlayerIsRefusedByItsLength) {
  v1::JoinInstanceRequest request;
  v1::JoinInstanceResponse response;
  const auto join = [&] {
    grpc::ClientContext context;
    return v1::SessionService::NewStub(Players())->JoinInstance(&context, request, &response);
  };
  request.set_instance_id(std::string(kPlayersMessageBytes + 1, 'x'));
  const grpc::Status refused = join();
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("larger than max"));
  request.set_instance_id("inst-1");
  EXPECT_EQ(join().error_code(), grpc::StatusCode::NOT_FOUND);
}

}  // namespace
}  // namespace tessera::control
