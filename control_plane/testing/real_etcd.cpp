#include "control_plane/testing/real_etcd.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "absl/strings/str_cat.h"
#include "control_plane/etcd/etcd_client.h"

namespace tessera::control {
namespace {

constexpr char kEtcdProgram[] = "/usr/bin/etcd";
// Ports that others take between our look and etcd's start are rare; then the next start takes others.
constexpr int kEtcdStarts = 5;

// etcd does not say which port it took for 0, so one that is free is looked for.
std::string FreeEndpoint() {
  const int probe = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  EXPECT_EQ(bind(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(getsockname(probe, reinterpret_cast<sockaddr*>(&address), &size), 0);
  close(probe);
  return absl::StrCat("127.0.0.1:", ntohs(address.sin_port));
}

}  // namespace

RealEtcd::RealEtcd() {
  for (int start = 0; start < kEtcdStarts; ++start) {
    endpoint_ = FreeEndpoint();
    const std::string clients = "http://" + endpoint_, peers = "http://" + FreeEndpoint();
    program_ = std::make_unique<host::WatchedProgram>(std::vector<std::string>{
        kEtcdProgram, "--name", "one", "--data-dir", absl::StrCat(folder_.path(), "/data", start),
        "--listen-client-urls", clients, "--advertise-client-urls", clients, "--listen-peer-urls", peers,
        "--initial-advertise-peer-urls", peers, "--initial-cluster", "one=" + peers});
    if (program_->WaitForText("ready to serve")) break;
  }
  const auto client = EtcdClient::Make(address("x"), {});
  etcdserverpb::RangeRequest request;
  request.set_key("x");
  const auto answer = (*client)->Range(request, host::kTestPatience);
  EXPECT_TRUE(answer.ok()) << answer.status() << "\n" << program_->Output();
}

RealEtcd& RealEtcd::Shared() {
  static RealEtcd shared;
  return shared;
}

}  // namespace tessera::control
