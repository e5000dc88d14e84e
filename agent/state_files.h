// StateFiles: regions' states on their way between workers, who read and write files, and the control plane, which
// keeps checkpoints.
//
// A fetched file is kept only if it has the announced hash, and appears whole or not at all; while the control plane
// is away it waits. An uploaded file is removed afterwards, whatever came of it: the control plane asks again.
// Thread rule: the event loop's thread, which also runs the callbacks.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "agent/control_link.h"
#include "agent/event_loop.h"
#include "agent/state_dir.h"
#include "agent/supervisor.h"

namespace tessera::agent {

class StateFiles {
 public:
  struct Callbacks {
    std::function<void(const WorkerKey& key, const std::string& path)> on_ready;
    std::function<void(const WorkerKey& key, const std::string& reason)> on_failed;  // asking again will not help
  };
  StateFiles(std::shared_ptr<EventLoop> loop, Callbacks callbacks);

  void Want(const FetchState& wanted);
  void Upload(const UploadState& what);
  void Connected(std::shared_ptr<ControlLink> link, const HostIdentity& identity);
  void Away() { link_.reset(); }
  // The worker is no more; what lies in `folder` of its is removed.
  void Forget(const WorkerKey& key, const std::string& folder);

 private:
  void Fetch(const WorkerKey& key);
  void Fetched(const WorkerKey& key, const absl::Status& status);
  void LogProgress();  // once in kProgressInterval, while anything is missing

  std::shared_ptr<EventLoop> loop_;
  Callbacks callbacks_;
  std::shared_ptr<ControlLink> link_;
  HostIdentity identity_;
  struct Missing {
    FetchState wanted;
    bool under_way = false;
    TimePoint since = Clock::now();
    std::string failure{};  // the last call's
  };
  std::map<WorkerKey, Missing> missing_;
  bool logs_progress_ = false;  // a timer will
};

}  // namespace tessera::agent
