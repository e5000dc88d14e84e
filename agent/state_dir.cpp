#include "agent/state_dir.h"

#include <fcntl.h>
#include <google/protobuf/util/json_util.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "agent/limits.h"

namespace tessera::agent {
namespace {

namespace fs = std::filesystem;

absl::Status FileError(const std::string& path, int error) {
  return absl::UnavailableError(absl::StrCat(path, ": ", std::strerror(error)));
}

absl::Status MakeFolder(const std::string& path) {
  std::error_code error;
  const bool made = fs::create_directories(path, error);
  if (error) return absl::UnavailableError(absl::StrCat(path, ": ", error.message()));
  if (made) fs::permissions(path, fs::perms::owner_all, error);
  return absl::OkStatus();
}

absl::Status WriteAll(int fd, const std::string& content) {
  for (std::size_t done = 0; done < content.size();) {
    const ssize_t n = write(fd, content.data() + done, content.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return absl::UnavailableError(std::strerror(errno));
    done += static_cast<std::size_t>(n);
  }
  return absl::OkStatus();
}

// The rename itself must reach the disk too.
void SyncFolderOf(const std::string& path) {
  const int fd = open(fs::path(path).parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  fsync(fd);
  close(fd);
}

template <class M>
absl::StatusOr<M> Load(const std::string& path) {
  const absl::StatusOr<std::string> text = ReadFile(path);
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
  for (const char* folder : {"", "/logs", "/scenes"}) {
    if (absl::Status status = MakeFolder(full + folder); !status.ok()) return status;
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
  return WriteFile(IdentityPath(), *json + "\n", true);
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
  return WriteFile(path_ + "/workers.json", *json + "\n", false);
}

std::string StateDir::LogPath(const v1::WorkerIdentity& worker) const {
  return absl::StrCat(path_, "/logs/", worker.instance_id(), "-r", worker.region(), "-i", worker.incarnation(), ".log");
}

void StateDir::PruneLogs(const std::set<std::string>& in_use) const {
  std::error_code error;
  std::vector<std::pair<fs::file_time_type, fs::path>> old;
  for (const auto& entry : fs::directory_iterator(path_ + "/logs", error)) {
    if (!in_use.contains(entry.path().string())) old.emplace_back(entry.last_write_time(error), entry.path());
  }
  if (old.size() <= kKeptLogs) return;
  std::sort(old.begin(), old.end());
  for (std::size_t i = 0; i < old.size() - kKeptLogs; ++i) fs::remove(old[i].second, error);
}

absl::Status WriteFile(const std::string& path, const std::string& content, bool durable) {
  // A name of its own, so that two threads which write the same scene do not share it; same folder, so rename is
  // atomic.
  std::string temporary = path + ".XXXXXX";
  const int fd = mkostemp(temporary.data(), O_CLOEXEC);
  if (fd < 0) return FileError(path, errno);
  absl::Status status = WriteAll(fd, content);
  if (status.ok() && durable && fsync(fd) != 0) status = absl::UnavailableError(std::strerror(errno));
  close(fd);
  if (status.ok() && std::rename(temporary.c_str(), path.c_str()) != 0) {
    status = absl::UnavailableError(std::strerror(errno));
  }
  if (!status.ok()) {
    unlink(temporary.c_str());
    return absl::UnavailableError(absl::StrCat(path, ": ", status.message()));
  }
  if (durable) SyncFolderOf(path);
  return absl::OkStatus();
}

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) {
    const int error = errno;
    if (error == ENOENT) return absl::NotFoundError(absl::StrCat(path, ": ", std::strerror(error)));
    return FileError(path, error);
  }
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
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

std::vector<std::string> LastLines(const std::string& path, std::size_t count) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in) return {};
  const auto size = static_cast<std::size_t>(in.tellg());
  const std::size_t want = std::min(size, count * (kMaxLineBytes + 1));
  in.seekg(static_cast<std::streamoff>(size - want));
  std::string tail(want, '\0');
  in.read(tail.data(), static_cast<std::streamsize>(want));
  tail.resize(static_cast<std::size_t>(in.gcount()));

  std::vector<std::string> lines;
  std::istringstream text(tail);
  for (std::string line; std::getline(text, line);) {
    if (line.size() > kMaxLineBytes) line.resize(kMaxLineBytes);
    for (char& c : line) {
      if (c < ' ' || c > '~') c = c == '\t' ? ' ' : '?';
    }
    lines.push_back(std::move(line));
  }
  if (want < size && lines.size() > 1) lines.erase(lines.begin());  // begins in the middle
  if (lines.size() > count) lines.erase(lines.begin(), lines.end() - static_cast<std::ptrdiff_t>(count));
  return lines;
}

}  // namespace tessera::agent
