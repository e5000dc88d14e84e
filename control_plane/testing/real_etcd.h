// RealEtcd: the program `etcd` of the system, one member at free ports of loopback, with its data in a folder that goes
// with it.
//
//   RealEtcd etcd;
//   auto client = EtcdClient::Make(etcd.address("tessera"), {});
//
// RealEtcd(kTls) speaks TLS and asks for a certificate of clients; RealEtcd(kAlone) is one of two members, of which the
// other never starts.
//
// Thread rule: the test's main thread.
#pragma once

#include <memory>
#include <string>

#include "control_plane/etcd/etcd_address.h"
#include "control_plane/etcd/etcd_client.h"
#include "host/temporary_folder.h"
#include "host/testing/watched_program.h"

namespace tessera::control {

class RealEtcd {
 public:
  enum class Kind { kPlain, kTls, kAlone };
  // But for kAlone it answers on return; the test fails otherwise.
  explicit RealEtcd(Kind kind = Kind::kPlain);
  // One for all tests of this process.
  static RealEtcd& Shared();

  EtcdAddress address(const std::string& prefix) const {
    return {.endpoints = {endpoint_}, .prefix = prefix, .is_local = true};
  }
  const std::string& endpoint() const { return endpoint_; }
  // kTls: what a client shows, and what it knows etcd by.
  EtcdCredentials credentials() const;
  host::WatchedProgram& program() { return *program_; }

 private:
  void MakeCertificate() const;

  host::TemporaryFolder folder_;
  std::string endpoint_;
  std::unique_ptr<host::WatchedProgram> program_;
};

}  // namespace tessera::control
