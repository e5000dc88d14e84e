#include "cli/instance_change.h"

#include <fmt/format.h>

#include "cli/checks.h"
#include "local_cluster/instance_watch.h"

namespace tessera::cli {

CLI::App* AddChange(CLI::App& instance, InstanceChange& change, const char* name, const char* about, bool with_id) {
  CLI::App* command = instance.add_subcommand(name, about);
  if (with_id) command->add_option("id", change.id, "Id of the instance, as 'instance list' shows it")->required();
  command->add_option("--timeout", change.timeout_s, "Seconds to wait at most")
      ->capture_default_str()
      ->check(CLI::PositiveNumber)
      ->check(Finite());
  return command;
}

void AwaitChange(local::Connection& connection, const InstanceChange& change, const std::string& what,
                 const std::function<bool(const v1::Instance&)>& holds) {
  local::InstanceWatch watch(connection, change.id);
  if (watch.WaitUntil(holds, change.patience())) return;
  const v1::Instance latest = watch.Latest();
  throw local::CommandError(fmt::format("instance/{} is not {} yet: {}", change.id, what,
                                        latest.changes().empty() ? latest.reason() : latest.changes(0).text()));
}

}  // namespace tessera::cli
