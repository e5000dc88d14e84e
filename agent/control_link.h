// ControlLink: one stream to the control plane, from dialling to its end.
//
//   auto link = ControlLink::Dial("10.0.0.1:7700", credentials, hello, {.on_message = ..., .on_closed = ...});
//   (*link)->Send(heartbeat);
//   (*link)->Close();  // messages sent before still go out; on_closed follows when the control plane has ended the
//   stream too
//
// It keeps itself alive until `on_closed`, which comes exactly once and last. Each link dials anew, so none of gRPC's
// own waiting between attempts is in the way. What waits to be sent never holds two heartbeats, nor two reports of one
// worker, nor two of its requests: the newer replaces the older, so a slow control plane costs no memory.
// Thread rule: every method from any thread. Callbacks run on gRPC's threads and must not block.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "agent/agent_state.pb.h"
#include "agent/content.h"
#include "tessera/v1/agent_link.pb.h"
#include "trust/dial.h"

namespace tessera::agent {

class ControlLink {
 public:
  struct Callbacks {
    std::function<void(v1::ControlMessage)> on_message;
    std::function<void(absl::Status)> on_closed;  // OK: the control plane ended the stream
  };
  // `leaves_silent`: a control plane that says nothing for 2 s is given up, because there are others. Errors: those of
  // trust::Dial; nothing was begun then.
  static absl::StatusOr<std::shared_ptr<ControlLink>> Dial(const std::string& address,
                                                           const trust::Credentials& credentials,
                                                           const v1::AgentHello& hello, Callbacks callbacks,
                                                           bool leaves_silent = false);
  virtual ~ControlLink() = default;

  virtual void Send(v1::AgentMessage message) = 0;
  virtual void Close() = 0;
  virtual void Cancel() = 0;
  // `done` is called once, on one of gRPC's threads: with the file, and with what became of it.
  virtual void FetchState(const v1::FetchStateRequest& request,
                          std::function<void(absl::StatusOr<std::string>)> done) = 0;
  virtual void UploadCheckpoint(const v1::UploadCheckpointRequest& request, std::string bytes,
                                std::function<void(absl::Status)> done) = 0;
  // The same, as the host that `identity` says.
  virtual void FetchContent(const Content& content, const HostIdentity& identity,
                            std::function<void(absl::StatusOr<std::string>)> done) = 0;
};

}  // namespace tessera::agent
