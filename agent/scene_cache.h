// SceneCache: scenes by hash, from the state folder or, once, from the control plane.
//
// A fetched scene is kept only if it is a scene and hashes to what was asked for; the file appears whole or not at all.
// A stored scene is checked when it is wanted, and fetched anew if it was damaged since. While the control plane is
// away, requests for missing scenes wait. Thread rule: the event loop's thread, which also runs the callbacks; checking
// and writing of what was fetched happens on gRPC's.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "agent/control_link.h"
#include "agent/event_loop.h"
#include "agent/state_dir.h"

namespace tessera::agent {

class SceneCache {
 public:
  struct Callbacks {
    std::function<void(const std::string& hash, const std::string& path)> on_ready;
    std::function<void(const std::string& hash, const std::string& reason)> on_failed;  // asking again will not help
  };
  // `state` outlives it.
  SceneCache(std::shared_ptr<EventLoop> loop, const StateDir& state, Callbacks callbacks);

  void Want(const std::string& hash);
  // As admitted by the control plane; asks for all that is missing.
  void Connected(std::shared_ptr<ControlLink> link, const HostIdentity& identity);
  void Away() { link_.reset(); }

 private:
  void Fetch(const std::string& hash);
  void Fetched(const std::string& hash, const absl::Status& status);

  std::shared_ptr<EventLoop> loop_;
  const StateDir& state_;
  Callbacks callbacks_;
  std::shared_ptr<ControlLink> link_;
  HostIdentity identity_;
  std::map<std::string, bool> missing_;  // by hash: whether a call is under way
};

// INVALID_ARGUMENT unless `bytes` is the scene with this hash: "no scene", "has hash ...". Any thread.
absl::Status CheckScene(const std::string& bytes, const std::string& hash);
// Checks the same of what the control plane sent and writes it to `path`. INTERNAL if the file cannot be written. Any
// thread.
absl::Status KeepScene(const std::string& bytes, const std::string& hash, const std::string& path);

}  // namespace tessera::agent
