// InstanceChange: what the commands that change a running world have in common: its id, how long they wait, and
// whether they only ask if it could be done.
//
//   local::Connection connection = Connect(globals);
//   const auto response =
//       SendChange(connection, change, "instance pause", &Instances::PauseInstance, v1::PauseInstanceRequest());
//   if (change.waits()) AwaitChange(connection, change, "paused", IsPaused);
//
// Errors are CommandError. Thread rule: one thread.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <functional>
#include <string>

#include "cli/instance_view.h"
#include "local_cluster/connection.h"

namespace tessera::cli {

using Instances = v1::InstanceService::Stub;

struct InstanceChange {
  std::string id;
  double timeout_s = 60;
  bool wait = false, dry_run = false;

  bool waits() const { return wait && !dry_run; }
  std::chrono::milliseconds patience() const { return Seconds(timeout_s); }
};

// A subcommand with the options --timeout and, unless it makes an instance, ID.
CLI::App* AddChange(CLI::App& instance, InstanceChange& change, const char* name, const char* about,
                    bool with_id = true);

// Calls `method` with the request, into which it fills the id and whether to validate only.
template <class Request, class Response>
Response SendChange(local::Connection& connection, const InstanceChange& change, const std::string& command,
                    grpc::Status (Instances::*method)(grpc::ClientContext*, const Request&, Response*), Request request,
                    std::chrono::milliseconds patience = std::chrono::seconds(10)) {
  request.set_id(change.id);
  request.set_validate_only(change.dry_run);
  return connection.Call(command, connection.instances(), method, request, patience);
}

// Until `holds`, at most for change.patience(): then "instance/inst-1 is not paused yet: ...", for `what` "paused".
void AwaitChange(local::Connection& connection, const InstanceChange& change, const std::string& what,
                 const std::function<bool(const v1::Instance&)>& holds);

}  // namespace tessera::cli
