// StateDir: the folder in which an agent keeps what must outlive it. One agent at a time.
//
//   host.json      id and secret of this host (0600)
//   revocations.json  the newest list of revocations
//   workers.json   what runs here, for the next agent
//   orders/        the last order of each worker, for an agent whose control plane begins from a backup
//   agent.sock     where workers attach
//   logs/          one file a worker, and a few before it where it grew large
//   scenes/        <hash>.pb, until no order has named it for an hour (ContentCache)
//   games/         <hash>.game, likewise
//   states/        a folder a worker: what it begins with, and its checkpoints until they are uploaded
//   lock           held while an agent runs
//
// Files appear whole or not at all. Thread rule: `ContentPath` from any thread; all else one owner.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "agent/agent_state.pb.h"
#include "agent/content.h"

namespace tessera::agent {

// Those files of it that are written while an agent runs, and of which it is told where they cannot be.
enum class StateFile { kIdentity, kWorkers, kOrders, kRevocations };
inline constexpr std::array kStateFiles{StateFile::kIdentity, StateFile::kWorkers, StateFile::kOrders,
                                        StateFile::kRevocations};
const char* NameOf(StateFile file);  // "host.json"

class StateDir {
 public:
  // Makes the folder (0700) where it does not exist. ALREADY_EXISTS if another agent holds it, INVALID_ARGUMENT if the
  // path of the socket in it would be too long for the kernel.
  static absl::StatusOr<std::unique_ptr<StateDir>> Open(const std::string& path);
  ~StateDir();
  StateDir(const StateDir&) = delete;
  StateDir& operator=(const StateDir&) = delete;

  // nullopt: not admitted yet. An error: the file is there but is not what it should be.
  absl::StatusOr<std::optional<HostIdentity>> LoadIdentity() const;
  absl::Status SaveIdentity(const HostIdentity& identity) const;
  absl::StatusOr<WorkersFile> LoadWorkers() const;
  absl::Status SaveWorkers(const WorkersFile& workers) const;
  // As the control plane gave it. Loading: nullopt where none was kept.
  absl::Status SaveOrder(const v1::WorkerIdentity& worker, const v1::WorkerOrder& order) const;
  absl::StatusOr<std::optional<v1::WorkerOrder>> LoadOrder(const v1::WorkerIdentity& worker) const;
  void ForgetOrder(const v1::WorkerIdentity& worker) const;
  // A file that cannot be read is out of the way, and its content kept: returns where.
  std::string SetWorkersAside() const;
  // Such a content lies there, until somebody removes it.
  bool WorkersAreAside() const;

  // An empty one where there is no file.
  absl::StatusOr<KeptRevocationsFile> LoadRevocations() const;
  absl::Status SaveRevocations(const KeptRevocationsFile& revocations) const;

  std::string RevocationsPath() const { return path_ + "/revocations.json"; }
  std::string IdentityPath() const { return path_ + "/host.json"; }
  std::string AsidePath() const { return path_ + "/workers.json.unreadable"; }
  std::string SocketPath() const { return path_ + "/agent.sock"; }
  std::string StatesPath() const { return path_ + "/states"; }
  std::string ScenesPath() const { return path_ + "/scenes"; }
  std::string GamesPath() const { return path_ + "/games"; }
  std::string LogPath(const v1::WorkerIdentity& worker) const;
  std::string OrderPath(const v1::WorkerIdentity& worker) const;
  std::string ContentPath(const Content& content) const;

  // Removes the oldest logs beyond kKeptLogs, but none of `in_use` and none of
  // theirs before (host/log_rotation.h).
  void PruneLogs(const std::set<std::string>& in_use) const;

 private:
  StateDir(std::string path, int lock) : path_(std::move(path)), lock_(lock) {}

  std::string path_;
  int lock_;
};

// One line of JSON, with the fields' names as in the .proto file.
absl::StatusOr<std::string> ToJson(const google::protobuf::Message& message);

}  // namespace tessera::agent
