#include "bench/lasting_stage.h"

#include <fmt/format.h>
#include <grpcpp/grpcpp.h>
#include <signal.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "control_plane/etcd/etcd_election.h"
#include "host/files.h"
#include "host/last_lines.h"
#include "host/process.h"
#include "local_cluster/connection.h"
#include "local_cluster/local_cluster.h"

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;
using Program = LastingStage::Program;

constexpr std::chrono::seconds kLastingPatience{60}, kLastingEnd{15};
constexpr std::size_t kMaxLastingFile = 4 << 20;
constexpr char kEtcdPath[] = "/usr/bin/etcd", kOpensslPath[] = "/usr/bin/openssl";
constexpr int kHeartbeatsAnElection = 10;
constexpr std::uint64_t kAlarmedMember = 1;  // in its name the alarm is raised: none of them
constexpr std::chrono::seconds kMemberPatience{5};
constexpr std::uint64_t kLastingDisk = 64 << 20;  // bytes a host; memory, as far as it is used
constexpr std::uint16_t kOperatorsPort = 7700, kPlayersPort = 7703, kEtcdPort = 2379, kEtcdPeerPort = 2380;
constexpr const char* kProgramNames[] = {"control", "etcd", "host"};

std::size_t IndexOf(Program program) { return static_cast<std::size_t>(program); }

}  // namespace

std::string LastingStage::Path(Program program, std::uint32_t which, const char* after) const {
  return fmt::format("{}/{}-{}{}", folder_, kProgramNames[IndexOf(program)], which + 1, after);
}

host::ChildProcess& LastingStage::process(Program program, std::uint32_t which) const {
  return *processes_.at(IndexOf(program)).at(which);
}

std::string LastingStage::EtcdEndpoints() const {
  std::string all;
  for (std::uint32_t i = 0; i < kLastingControls; ++i) {
    absl::StrAppend(&all, i == 0 ? "" : ",", network_.address(i), ":", kEtcdPort);
  }
  return all;
}

std::vector<std::string> LastingStage::Arguments(Program program, std::uint32_t which) const {
  const auto path = [&](const char* after) { return Path(program, which, after); };
  if (program == Program::kEtcd) {
    const std::string own = network_.address(which);
    const std::string clients = fmt::format("https://{}:{}", own, kEtcdPort);
    const std::string peers = fmt::format("http://{}:{}", own, kEtcdPeerPort);
    std::string cluster;
    for (std::uint32_t i = 0; i < kLastingControls; ++i) {
      absl::StrAppend(&cluster, i == 0 ? "" : ",", "m", i, "=http://", network_.address(i), ":", kEtcdPeerPort);
    }
    return {kEtcdPath,
            "--name",
            absl::StrCat("m", which),
            "--data-dir",
            path(""),
            "--listen-client-urls",
            clients,
            "--advertise-client-urls",
            clients,
            "--listen-peer-urls",
            peers,
            "--initial-advertise-peer-urls",
            peers,
            "--pre-vote",
            "--election-timeout",
            absl::StrCat(setup_.election.count()),
            "--heartbeat-interval",
            absl::StrCat(setup_.election.count() / kHeartbeatsAnElection),
            "--initial-cluster",
            cluster,
            "--cert-file",
            folder_ + "/etcd.pem",
            "--key-file",
            folder_ + "/etcd.key"};
  }
  if (program == Program::kControl) {
    const std::string own = network_.address(which);
    std::vector<std::string> argv{local::ProgramPath("tessera-control"),
                                  "--listen",
                                  fmt::format("{}:{}", own, kOperatorsPort),
                                  "--players-listen",
                                  fmt::format("{}:{}", own, kPlayersPort),
                                  "--metrics-listen",
                                  "127.0.0.1:7701",
                                  "--state-dir",
                                  path(""),
                                  "--ready-file",
                                  path(".json"),
                                  "--checkpoints",
                                  folder_ + "/checkpoints"};
    if (setup_.etcd) {
      const std::string store = absl::StrCat("etcd://", EtcdEndpoints(), "/", prefix());
      argv.insert(argv.end(), {"--store", store, "--store-authority", folder_ + "/etcd.pem"});
    }
    return argv;
  }
  std::string doors;
  for (std::uint32_t i = 0; i < controls(); ++i) {
    absl::StrAppend(&doors, i == 0 ? "" : ",", network_.address(i), ":", kOperatorsPort);
  }
  return {local::ProgramPath("tessera-agent"),
          "--control",
          doors,
          "--state-dir",
          path(""),
          "--ready-file",
          path(".json"),
          "--join-token-file",
          path(".token"),
          "--advertise-address",
          network_.address(MachineOf(which)),
          "--metrics-listen",
          "127.0.0.1:0",
          "--port-range",
          "7800-7899",
          "--capacity",
          "4",
          "--stop-workers"};
}

std::string LastingStage::NameOfHost(std::uint32_t host) { return absl::StrCat("host-", host + 1); }

std::optional<std::uint32_t> LastingStage::HostNamed(const std::string& name) {
  for (std::uint32_t host = 0; host < kLastingHosts; ++host) {
    if (name == NameOfHost(host)) return host;
  }
  return std::nullopt;
}

// --- Starting.

// One for all members: by it clients know them, and it signs itself.
absl::Status LastingStage::MakeEtcdCertificate() const {
  std::string names = "subjectAltName=";
  for (std::uint32_t i = 0; i < kLastingControls; ++i)
    absl::StrAppend(&names, i == 0 ? "IP:" : ",IP:", network_.address(i));
  return RunToItsEnd(
      {kOpensslPath, "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout",
       folder_ + "/etcd.key", "-out", folder_ + "/etcd.pem", "-days", "2", "-subj", "/CN=etcd", "-addext", names},
      "openssl");
}

absl::Status LastingStage::RunToItsEnd(const std::vector<std::string>& argv, const char* log) const {
  const std::string path = fmt::format("{}/{}.log", folder_, log);
  auto run = host::ChildProcess::Start({.argv = argv, .log_path = path});
  if (!run.ok()) return run.status();
  const auto ended = run->Wait(kLastingPatience);
  if (ended && ended->Clean()) return absl::OkStatus();
  return absl::UnavailableError(log + host::LastLinesText(path, 3));
}

absl::Status LastingStage::StartEtcd() {
  absl::Status status = MakeEtcdCertificate();
  for (std::uint32_t i = 0; i < kLastingControls && status.ok(); ++i) {
    auto slow = SlowFsync::Begin();
    if (!slow.ok()) return slow.status();
    slow_.at(i) = *std::move(slow);
    status = Launch(Program::kEtcd, i);
  }
  return status.ok() ? ConnectEtcd() : status;
}

absl::Status LastingStage::Launch(Program program, std::uint32_t which) {
  const std::uint32_t machine = program == Program::kAgent ? MachineOf(which) : which;
  std::vector<std::string> argv = network_.Enter(machine);
  const std::vector<std::string> own = Arguments(program, which);
  argv.insert(argv.end(), own.begin(), own.end());
  fs::remove(Path(program, which, ".json"));
  const host::ProcessSpec spec{.argv = argv, .log_path = Path(program, which, ".log")};
  auto started = program == Program::kEtcd ? slow_.at(which)->Start(spec) : host::ChildProcess::Start(spec);
  if (!started.ok()) return started.status();
  processes_.at(IndexOf(program)).at(which) = *std::move(started);
  return absl::OkStatus();
}

absl::Status LastingStage::Await(Program program, std::uint32_t which) {
  if (program == Program::kEtcd ||
      process(program, which).WaitForFile(Path(program, which, ".json"), kLastingPatience)) {
    return absl::OkStatus();
  }
  return absl::UnavailableError(
      fmt::format("{} {}{}", kProgramNames[IndexOf(program)], which + 1, LastWords(program, which)));
}

std::string LastingStage::LastWords(Program program, std::uint32_t which) const {
  return host::LastLinesText(Path(program, which, ".log"), 5);
}

absl::StatusOr<std::unique_ptr<LastingStage>> LastingStage::Start(const local::HostNetwork& network,
                                                                  const std::string& folder, LastingSetup setup) {
  std::unique_ptr<LastingStage> stage(new LastingStage(network, folder, setup));
  absl::Status status = setup.etcd ? stage->StartEtcd() : absl::OkStatus();
  if (status.ok()) status = stage->StartControls();
  if (status.ok()) status = stage->TakeRights();
  if (status.ok()) status = stage->StartHosts();
  if (!status.ok()) return status;
  return stage;
}

absl::Status LastingStage::ConnectEtcd() {
  const auto authority = host::ReadFile(folder_ + "/etcd.pem", kMaxLastingFile);
  if (!authority.ok()) return authority.status();
  control::EtcdAddress address{
      .endpoints = absl::StrSplit(EtcdEndpoints(), ','), .prefix = prefix(), .is_local = false};
  auto client = control::EtcdClient::Make(address, {.authority = *authority, .certificate = {}, .key = {}});
  if (!client.ok()) return client.status();
  etcd_ = *std::move(client);
  etcdserverpb::RangeRequest request;
  request.set_key("x");
  if (const auto up = etcd_->Range(request, kLastingPatience); !up.ok()) {
    return absl::UnavailableError(absl::StrCat(up.status().message(), LastWords(Program::kEtcd, 0)));
  }
  return absl::OkStatus();
}

// The first one that leads makes the authority, and the seal that the others need.
absl::Status LastingStage::StartControls() {
  if (!setup_.etcd) {
    auto disk = SmallDisk::Mount(Path(Program::kControl, 0, ""), kLastingDisk);
    if (!disk.ok()) return disk.status();
    store_disk_ = *std::move(disk);
  }
  for (std::uint32_t i = 0; i < controls(); ++i) {
    std::error_code error;
    fs::create_directories(Path(Program::kControl, i, ""), error);
    if (i > 0) fs::copy(Path(Program::kControl, 0, "/seal.key"), Path(Program::kControl, i, "/seal.key"), error);
    if (error) return absl::UnavailableError(absl::StrCat(Path(Program::kControl, i, ""), ": ", error.message()));
    if (absl::Status status = Launch(Program::kControl, i); !status.ok()) return status;
    if (absl::Status status = Await(Program::kControl, i); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status LastingStage::TakeRights() {
  try {
    local::Connection socket(trust::ControlPoint("unix:" + Path(Program::kControl, 0, "/control.sock")));
    using Access = v1::AccessService::Stub;
    const auto authority = socket.Call("authority", socket.access(), &Access::GetAuthority, v1::GetAuthorityRequest());
    v1::CreateTokenRequest request;
    request.set_name("lasting");
    request.set_role(v1::ROLE_ADMINISTRATOR);
    control_.credentials.bearer_token = socket.Call("token", socket.access(), &Access::CreateToken, request).secret();
    for (std::uint32_t i = 0; i < controls(); ++i) {
      const char* comma = i == 0 ? "" : ",";
      absl::StrAppend(&control_.address, comma, network_.address(i), ":", kOperatorsPort, "#", authority.fingerprint());
      absl::StrAppend(&players_, comma, network_.address(i), ":", kPlayersPort, "#", authority.fingerprint());
    }
  } catch (const std::exception& error) {
    return absl::UnavailableError(error.what());
  }
  return absl::OkStatus();
}

absl::Status LastingStage::StartHosts() {
  try {
    local::Connection connection(control_);
    for (std::uint32_t i = 0; i < kLastingHosts; ++i) {
      auto disk = SmallDisk::Mount(Path(Program::kAgent, i, ""), kLastingDisk);
      if (!disk.ok()) return disk.status();
      disks_.at(i) = *std::move(disk);
      v1::AddHostRequest request;
      request.set_name(NameOfHost(i));
      const auto added = connection.Call("host add", connection.hosts(), &v1::HostService::Stub::AddHost, request);
      if (absl::Status status = host::WriteFile(Path(Program::kAgent, i, ".token"), added.join_token() + "\n",
                                                host::Durability::kSurvivesProcess);
          !status.ok()) {
        return status;
      }
      if (absl::Status status = Launch(Program::kAgent, i); !status.ok()) return status;
    }
  } catch (const std::exception& error) {
    return absl::UnavailableError(error.what());
  }
  for (std::uint32_t i = 0; i < kLastingHosts; ++i) {
    if (absl::Status status = Await(Program::kAgent, i); !status.ok()) return status;
  }
  return absl::OkStatus();
}

// Whatever state it was left in: nothing of it runs on.
LastingStage::~LastingStage() {
  for (std::uint32_t i = 0; i < kLastingHosts; ++i) SignalHost(i, SIGCONT);
  for (const auto& program : processes_) {
    for (const auto& one : program) {
      if (one) one->Signal(SIGCONT);
    }
  }
  auto& agents = processes_.at(IndexOf(Program::kAgent));
  for (const auto& agent : agents) {
    if (agent) agent->Signal(SIGTERM);
  }
  for (auto& agent : agents) {
    if (agent) agent->End(kLastingEnd);
  }
  for (std::uint32_t i = 0; i < kLastingHosts; ++i) {
    for (const Worker& worker : WorkersOn(i)) {
      if (const auto left = host::Process::Adopt(worker.pid, worker.start_time); left.ok()) left->Signal(SIGKILL);
    }
  }
  for (const Program program : {Program::kControl, Program::kEtcd}) {
    for (auto& one : processes_.at(IndexOf(program))) {
      if (one) one->Signal(SIGKILL);
    }
    for (auto& one : processes_.at(IndexOf(program))) one.reset();
  }
}

// --- What is so.

std::optional<std::uint32_t> LastingStage::Leader() const {
  if (!setup_.etcd) return 0;
  etcdserverpb::RangeRequest request;
  request.set_key(absl::StrCat(prefix(), "/leader"));
  const auto found = etcd_->Range(request, std::chrono::seconds(1));
  if (!found.ok() || found->kvs_size() == 0) return std::nullopt;
  const auto address = control::ReadLeaderAddress(found->kvs(0).value());
  for (std::uint32_t i = 0; address && i < kLastingControls; ++i) {
    if (address->operators == fmt::format("{}:{}", network_.address(i), kOperatorsPort)) return i;
  }
  return std::nullopt;
}

std::optional<std::uint32_t> LastingStage::StoreLeader() const {
  for (std::uint32_t i = 0; i < kLastingControls; ++i) {
    const auto member = Maintenance(i);
    if (!member.ok()) return std::nullopt;
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kMemberPatience);
    etcdserverpb::StatusResponse response;
    if (!(*member)->Status(&context, {}, &response).ok()) continue;
    if (response.leader() != 0 && response.leader() == response.header().member_id()) return i;
  }
  return std::nullopt;
}

std::vector<LastingStage::Worker> LastingStage::WorkersOn(std::uint32_t host) const {
  const auto text = host::ReadFile(Path(Program::kAgent, host, "/workers.json"), kMaxLastingFile);
  const auto file = nlohmann::json::parse(text.value_or("{}"), nullptr, false);
  std::vector<Worker> workers;
  if (!file.is_object() || !file.contains("workers")) return workers;
  for (const nlohmann::json& record : file.at("workers")) {
    const nlohmann::json& id = record.at("identity");
    const auto number = [](const nlohmann::json& of, const char* name) -> std::uint64_t {
      if (!of.contains(name)) return 0;
      return of.at(name).is_string() ? std::stoull(of.at(name).get<std::string>()) : of.at(name).get<std::uint64_t>();
    };
    workers.push_back(
        {.name = fmt::format("{}/{}#{}", id.value("instance_id", ""), number(id, "region"), number(id, "incarnation")),
         .region = static_cast<std::uint32_t>(number(id, "region")),
         .pid = static_cast<pid_t>(number(id, "pid")),
         .start_time = number(record, "start_time"),
         .metrics_port = static_cast<std::uint16_t>(number(record, "first_port") + 2)});
  }
  return workers;
}

// --- Faults.

void LastingStage::Signal(Program program, std::uint32_t which, int signal) const {
  process(program, which).Signal(signal);
}

void LastingStage::Kill(Program program, std::uint32_t which) {
  Signal(program, which, SIGKILL);
  process(program, which).Wait(kLastingEnd);
}

absl::Status LastingStage::Restart(Program program, std::uint32_t which) {
  if (!process(program, which).Wait(std::chrono::milliseconds(0))) return absl::OkStatus();
  if (absl::Status status = Launch(program, which); !status.ok()) return status;
  return absl::OkStatus();
}

// By the alarm that a member raises when its database has reached its quota: all members then refuse what takes room.
// Raising it by real writes takes gigabytes, and a repair that no caller of the API can make while it holds.
absl::Status LastingStage::SetStoreFull(bool full) const {
  if (!setup_.etcd) {
    if (full) return store_disk_->Fill();
    store_disk_->Free();
    return absl::OkStatus();
  }
  etcdserverpb::AlarmRequest request;
  request.set_action(full ? etcdserverpb::AlarmRequest::ACTIVATE : etcdserverpb::AlarmRequest::DEACTIVATE);
  request.set_memberid(kAlarmedMember);
  request.set_alarm(etcdserverpb::NOSPACE);
  grpc::Status status;
  for (std::uint32_t i = 0; i < kLastingControls; ++i) {  // any member tells all
    const auto member = Maintenance(i);
    if (!member.ok()) return member.status();
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kMemberPatience);
    etcdserverpb::AlarmResponse response;
    status = (*member)->Alarm(&context, request, &response);
    if (status.ok()) return absl::OkStatus();
  }
  return absl::UnavailableError(absl::StrCat("the alarm of etcd: ", status.error_message()));
}

absl::StatusOr<std::unique_ptr<etcdserverpb::Maintenance::Stub>> LastingStage::Maintenance(std::uint32_t member) const {
  const auto authority = host::ReadFile(folder_ + "/etcd.pem", kMaxLastingFile);
  if (!authority.ok()) return authority.status();
  grpc::SslCredentialsOptions trusted;
  trusted.pem_root_certs = *authority;
  const std::string address = fmt::format("{}:{}", network_.address(member), kEtcdPort);
  return etcdserverpb::Maintenance::NewStub(grpc::CreateChannel(address, grpc::SslCredentials(trusted)));
}

absl::Status LastingStage::BackUp(const std::string& file) const {
  const auto leader = Leader();
  if (!leader) return absl::UnavailableError("nobody leads");
  return RunToItsEnd({local::ProgramPath("tessera"), "--control",
                      "unix:" + Path(Program::kControl, *leader, "/control.sock"), "cluster", "backup", file},
                     "backup");
}

absl::Status LastingStage::BeginFrom(const std::string& backup) const {
  etcdserverpb::TxnRequest request;
  etcdserverpb::DeleteRangeRequest& all = *request.add_success()->mutable_request_delete_range();
  all.set_key(absl::StrCat(prefix(), "/"));
  all.set_range_end(control::EtcdRangeEnd(all.key()));
  if (const auto emptied = etcd_->Write(request, kMemberPatience); !emptied.ok()) return emptied.status();
  std::vector<std::string> argv = network_.Enter(0);
  const std::vector<std::string> own = Arguments(Program::kControl, 0);
  argv.insert(argv.end(), own.begin(), own.end());
  argv.insert(argv.end(), {"--restore", backup});
  return RunToItsEnd(argv, "restore");
}

void LastingStage::SignalHost(std::uint32_t host, int signal) const {
  if (!processes_.at(IndexOf(Program::kAgent)).at(host)) return;
  Signal(Program::kAgent, host, signal);
  for (const Worker& worker : WorkersOn(host)) {
    if (const auto found = host::Process::Adopt(worker.pid, worker.start_time); found.ok()) found->Signal(signal);
  }
}

}  // namespace tessera::bench
