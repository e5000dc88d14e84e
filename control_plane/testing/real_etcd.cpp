#include "control_plane/testing/real_etcd.h"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "control_plane/etcd/etcd_client.h"
#include "control_plane/testing/free_address.h"

namespace tessera::control {
namespace {

constexpr char kEtcdProgram[] = "/usr/bin/etcd";
// Ports that others take between our look and etcd's start are rare; then the next start takes others.
constexpr int kEtcdStarts = 5;

}  // namespace

RealEtcd::RealEtcd() {
  for (int start = 0; start < kEtcdStarts; ++start) {
    endpoint_ = FreeLoopbackAddress();
    const std::string clients = "http://" + endpoint_, peers = "http://" + FreeLoopbackAddress();
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
