// ContentCache: scenes and games by hash, from the state folder or, once, from the control plane.
// They stay until no order has named them for an hour.
//
// Fetched content is kept only if it has the hash that was asked for; the file appears whole or not at all. A stored
// file is checked when it is wanted, and fetched anew if it was damaged since. While the control plane is away, the
// requests for missing content wait. Thread rule: the event loop's thread, which also runs the callbacks; fetched
// content is checked and written on gRPC's.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "agent/content.h"
#include "agent/control_link.h"
#include "agent/event_loop.h"
#include "agent/state_dir.h"

namespace tessera::agent {

class ContentCache {
 public:
  struct Callbacks {
    std::function<void(const Content& content, const std::string& path)> on_ready;
    std::function<void(const Content& content, const std::string& reason)> on_failed;  // asking again will not help
  };
  // `state` outlives it.
  ContentCache(std::shared_ptr<EventLoop> loop, const StateDir& state, Callbacks callbacks);

  void Want(const Content& content);
  // As admitted by the control plane; asks for all that is missing.
  void Connected(std::shared_ptr<ControlLink> link, const HostIdentity& identity);
  void Away() { link_.reset(); }
  // Time passes: removes files that were in no `named` for kContentKept, a bounded number. Every kContentLook.
  void RemoveUnnamed(const std::set<Content>& named, TimePoint now);

 private:
  void Fetch(const Content& content);
  void Fetched(const Content& content, const absl::Status& status);

  std::shared_ptr<EventLoop> loop_;
  const StateDir& state_;
  Callbacks callbacks_;
  std::shared_ptr<ControlLink> link_;
  HostIdentity identity_;
  std::map<Content, bool> missing_;                 // whether a call is under way
  std::map<std::string, TimePoint> unnamed_since_;  // files, by path
};

// Checks what the control plane sent and writes it to `path`. INTERNAL if the file cannot be written. Any thread.
absl::Status KeepContent(const Content& content, const std::string& bytes, const std::string& path);

}  // namespace tessera::agent
