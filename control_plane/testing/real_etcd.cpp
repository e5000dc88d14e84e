#include "control_plane/testing/real_etcd.h"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "control_plane/etcd/etcd_client.h"
#include "control_plane/testing/free_address.h"
#include "host/files.h"

namespace tessera::control {
namespace {

constexpr char kEtcdProgram[] = "/usr/bin/etcd";
// Ports that others take between our look and etcd's start are rare; then the next start takes others.
constexpr int kEtcdStarts = 5;
constexpr std::size_t kMaxTestPemBytes = 64 << 10;

}  // namespace

RealEtcd::RealEtcd(Kind kind) {
  const std::string scheme = kind == Kind::kTls ? "https://" : "http://";
  if (kind == Kind::kTls) MakeCertificate();
  for (int start = 0; start < kEtcdStarts; ++start) {
    endpoint_ = FreeLoopbackAddress();
    const std::string clients = scheme + endpoint_, peers = "http://" + FreeLoopbackAddress();
    std::vector<std::string> argv{kEtcdProgram,
                                  "--name",
                                  "one",
                                  "--data-dir",
                                  absl::StrCat(folder_.path(), "/data", start),
                                  "--listen-client-urls",
                                  clients,
                                  "--advertise-client-urls",
                                  clients,
                                  "--listen-peer-urls",
                                  peers,
                                  "--initial-advertise-peer-urls",
                                  peers,
                                  "--initial-cluster",
                                  "one=" + peers};
    if (kind == Kind::kAlone) argv.back() += ",two=http://" + FreeLoopbackAddress();
    if (kind == Kind::kTls) {
      const std::string pem = folder_.path() + "/etcd.pem";
      argv.insert(argv.end(), {"--cert-file", pem, "--key-file", folder_.path() + "/etcd.key", "--trusted-ca-file", pem,
                               "--client-cert-auth"});
    }
    program_ = std::make_unique<host::WatchedProgram>(std::move(argv));
    if (program_->WaitForText(kind == Kind::kAlone ? "became candidate" : "ready to serve")) break;
  }
  if (kind == Kind::kAlone) return;
  const auto client = EtcdClient::Make(address("x"), credentials());
  etcdserverpb::RangeRequest request;
  request.set_key("x");
  const auto answer = (*client)->Range(request, host::kTestPatience);
  EXPECT_TRUE(answer.ok()) << answer.status() << "\n" << program_->Output();
}

// It signs itself, and clients show it too.
void RealEtcd::MakeCertificate() const {
  host::WatchedProgram openssl({"/usr/bin/openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                                "ec_paramgen_curve:P-256", "-nodes", "-keyout", folder_.path() + "/etcd.key", "-out",
                                folder_.path() + "/etcd.pem", "-days", "2", "-subj", "/CN=etcd", "-addext",
                                "subjectAltName=IP:127.0.0.1"});
  EXPECT_TRUE(openssl.Wait().Clean()) << openssl.Output();
}

EtcdCredentials RealEtcd::credentials() const {
  const auto pem = host::ReadFile(folder_.path() + "/etcd.pem", kMaxTestPemBytes);
  const auto key = host::ReadFile(folder_.path() + "/etcd.key", kMaxTestPemBytes);
  if (!pem.ok() || !key.ok()) return {};
  return {.authority = *pem, .certificate = *pem, .key = *key};
}

RealEtcd& RealEtcd::Shared() {
  static RealEtcd shared;
  return shared;
}

}  // namespace tessera::control
