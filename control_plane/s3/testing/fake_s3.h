// FakeS3: an object store on this machine, for tests. It speaks what S3Client uses, checks each signature by its own
// reckoning (version 4, "Authenticating Requests" of Amazon's reference of S3), and can misbehave.
//
//   FakeS3 store;                                   // listens on a free port
//   S3Client client(store.Settings("s3://worlds/tessera"));
//   store.fail_next = 2;                            // the next two requests: 503
//
// Thread rule: any thread, but set the faults while no request is under way.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "control_plane/s3/s3_address.h"

namespace tessera::control {

class FakeS3 {
 public:
  FakeS3();
  ~FakeS3();

  // For somebody who may. The bucket "worlds" is there.
  S3Settings Settings(const std::string& address) const;
  // Without objects, requests and faults.
  void Reset();
  // The objects, by "bucket/key".
  std::map<std::string, std::string> Objects() const;
  void Damage(const std::string& path);
  // The requests so far, "PUT worlds/tessera/inst-1/60/scene".
  std::vector<std::string> Requests() const;

  // --- Faults.
  std::atomic<int> fail_next{0};         // so many requests get 503
  std::atomic<bool> deny{false};         // 403 for everybody
  std::atomic<bool> cut_answers{false};  // an object ends before its announced length
  std::atomic<std::size_t> page_size{1000};
  // While it is on, nothing is answered.
  void Hang(bool on);

 private:
  struct Server;
  std::unique_ptr<Server> server_;
};

}  // namespace tessera::control
