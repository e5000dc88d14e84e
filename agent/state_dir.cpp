#include "agent/state_dir.h"

#include <fcntl.h>
#include <google/protobuf/util/json_util.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "agent/limits.h"
#include "host/files.h"
#include "host/log_rotation.h"

namespace tessera::agent {
namespace {

namespace fs = std::filesystem;

absl::Status FileError(const std::string& path, int error) {
  return absl::UnavailableError(absl::StrCat(path, ": ", std::strerror(error)));
}

template <class M>
absl::StatusOr<M> Load(const std::string& path) {
  const absl::StatusOr<std::string> text = host::ReadFile(path, kMaxStateFileBytes);
  if (!text.ok()) return text.status();
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  M message;
  if (const auto status = google::protobuf::util::JsonStringToMessage(*text, &message, options); !status.ok()) {
    const std::string why = status.message().as_string();  // a picture of the place follows on lines of its own
    return absl::DataLossError(absl::StrCat(path, ": not what an agent wrote: ", why.substr(0, why.find('\n'))));
  }
  return message;
}

}  // namespace

const char* NameOf(StateFile file) {
  switch (file) {
    case StateFile::kIdentity:
      return "host.json";
    case StateFile::kWorkers:
      return "workers.json";
    case StateFile::kOrders:
      return "orders";
    case StateFile::kRevocations:
      return "revocations.json";
  }
  return "";
}

absl::StatusOr<std::unique_ptr<StateDir>> StateDir::Open(const std::string& path) {
  std::error_code error;
  const std::string full = fs::absolute(path, error).lexically_normal().string();
  if (path.empty() || error) return absl::InvalidArgumentError(absl::StrCat("--state-dir \"", path, "\" is no path"));
  const std::string socket = full + "/agent.sock";
  if (socket.size() > kMaxSocketPath) {
    return absl::InvalidArgumentError(absl::StrCat("socket path ", socket, " has ", socket.size(),
                                                   " bytes, the kernel takes ", kMaxSocketPath,
                                                   "; choose a shorter --state-dir"));
  }
  for (const char* folder : {"", "/logs", "/orders", "/scenes", "/games"}) {
    if (absl::Status status = host::MakePrivateFolder(full + folder); !status.ok()) return status;
  }
  const std::string lock_path = full + "/lock";
  const int lock = open(lock_path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (lock < 0) return FileError(lock_path, errno);
  if (flock(lock, LOCK_EX | LOCK_NB) != 0) {
    const int lock_error = errno;
    close(lock);
    if (lock_error != EWOULDBLOCK) return FileError(lock_path, lock_error);
    return absl::AlreadyExistsError(absl::StrCat("another agent runs on state folder ", full));
  }
  return std::unique_ptr<StateDir>(new StateDir(full, lock));
}

StateDir::~StateDir() { close(lock_); }

absl::StatusOr<std::optional<HostIdentity>> StateDir::LoadIdentity() const {
  absl::StatusOr<HostIdentity> identity = Load<HostIdentity>(IdentityPath());
  if (absl::IsNotFound(identity.status())) return std::nullopt;
  if (!identity.ok()) return identity.status();
  if (identity->host_id().empty() || identity->host_secret().empty()) {
    return absl::DataLossError(absl::StrCat(IdentityPath(), ": host_id or host_secret is missing"));
  }
  return *std::move(identity);
}

absl::Status StateDir::SaveIdentity(const HostIdentity& identity) const {
  absl::StatusOr<std::string> json = ToJson(identity);
  if (!json.ok()) return json.status();
  return host::WriteFile(IdentityPath(), *json + "\n", host::Durability::kSurvivesMachine);
}

absl::StatusOr<WorkersFile> StateDir::LoadWorkers() const {
  absl::StatusOr<WorkersFile> workers = Load<WorkersFile>(path_ + "/workers.json");
  if (absl::IsNotFound(workers.status())) return WorkersFile();
  return workers;
}

absl::Status StateDir::SaveWorkers(const WorkersFile& workers) const {
  absl::StatusOr<std::string> json = ToJson(workers);
  if (!json.ok()) return json.status();
  // Not durable: after a crash of the machine none of these processes is left.
  return host::WriteFile(path_ + "/workers.json", *json + "\n", host::Durability::kSurvivesProcess);
}

// Not durable either. Each replaces the one before, so a binary file that is written in a moment.
absl::Status StateDir::SaveOrder(const v1::WorkerIdentity& worker, const v1::WorkerOrder& order) const {
  return host::WriteFile(OrderPath(worker), order.SerializeAsString(), host::Durability::kSurvivesProcess);
}

absl::StatusOr<std::optional<v1::WorkerOrder>> StateDir::LoadOrder(const v1::WorkerIdentity& worker) const {
  const std::string path = OrderPath(worker);
  const absl::StatusOr<std::string> bytes = host::ReadFile(path, kMaxMessageBytes);
  if (absl::IsNotFound(bytes.status())) return std::nullopt;
  if (!bytes.ok()) return bytes.status();
  v1::WorkerOrder order;
  const bool whole = order.ParseFromString(*bytes) && order.instance_id() == worker.instance_id() &&
                     order.region() == worker.region() && order.incarnation() == worker.incarnation();
  if (!whole) return absl::DataLossError(absl::StrCat(path, ": not what an agent wrote"));
  return order;
}

void StateDir::ForgetOrder(const v1::WorkerIdentity& worker) const {
  std::error_code ignored;  // one that stays is of a worker that never comes again
  fs::remove(OrderPath(worker), ignored);
}

std::string StateDir::SetWorkersAside() const {
  std::error_code ignored;  // where it cannot be renamed, the next save replaces it
  fs::rename(path_ + "/workers.json", AsidePath(), ignored);
  return AsidePath();
}

bool StateDir::WorkersAreAside() const {
  std::error_code ignored;
  return fs::exists(AsidePath(), ignored);
}

absl::StatusOr<KeptRevocationsFile> StateDir::LoadRevocations() const {
  absl::StatusOr<KeptRevocationsFile> revocations = Load<KeptRevocationsFile>(RevocationsPath());
  if (absl::IsNotFound(revocations.status())) return KeptRevocationsFile();
  return revocations;
}

absl::Status StateDir::SaveRevocations(const KeptRevocationsFile& revocations) const {
  absl::StatusOr<std::string> json = ToJson(revocations);
  if (!json.ok()) return json.status();
  return host::WriteFile(RevocationsPath(), *json + "\n", host::Durability::kSurvivesMachine);
}

std::string StateDir::LogPath(const v1::WorkerIdentity& worker) const {
  return absl::StrCat(path_, "/logs/", worker.instance_id(), "-r", worker.region(), "-i", worker.incarnation(), ".log");
}

std::string StateDir::OrderPath(const v1::WorkerIdentity& worker) const {
  return absl::StrCat(path_, "/orders/", worker.instance_id(), "-r", worker.region(), "-i", worker.incarnation(),
                      ".pb");
}

std::string StateDir::ContentPath(const Content& content) const {
  const bool scene = content.kind == ContentKind::kScene;
  return absl::StrCat(path_, scene ? "/scenes/" : "/games/", content.hash, scene ? ".pb" : ".game");
}

void StateDir::PruneLogs(const std::set<std::string>& in_use) const {
  std::error_code error;
  std::vector<std::pair<fs::file_time_type, fs::path>> old;
  for (const auto& entry : fs::directory_iterator(path_ + "/logs", error)) {
    const std::string path = entry.path().string();
    const bool is_in_use = std::any_of(in_use.begin(), in_use.end(), [&](const std::string& current) {
      return path == current || host::IsEarlierLogOf(path, current);
    });
    if (!is_in_use) old.emplace_back(entry.last_write_time(error), entry.path());
  }
  if (old.size() <= kKeptLogs) return;
  std::sort(old.begin(), old.end());
  for (std::size_t i = 0; i < old.size() - kKeptLogs; ++i) fs::remove(old[i].second, error);
}

absl::StatusOr<std::string> ToJson(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string json;
  if (const auto status = google::protobuf::util::MessageToJsonString(message, &json, options); !status.ok()) {
    return absl::InternalError(status.message().as_string());
  }
  return json;
}

}  // namespace tessera::agent
