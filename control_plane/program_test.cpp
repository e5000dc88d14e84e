// tessera-control as a process: readiness, one-line errors, an end in order, and its store after a kill.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>

#include <csignal>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/files.h"
#include "host/temporary_folder.h"
#include "host/testing/watched_program.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tessera/v1/visuals.grpc.pb.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

constexpr std::size_t kMaxReadyBytes = 4096;

class ProgramTest : public ::testing::Test {
 protected:
  // The program, until it is ready or has ended.
  std::unique_ptr<host::WatchedProgram> Start(std::vector<std::string> arguments) {
    std::filesystem::remove(ready_);
    arguments.insert(arguments.begin(), TESSERA_CONTROL_PROGRAM);
    arguments.insert(arguments.end(), {"--ready-file", ready_});
    auto program = std::make_unique<host::WatchedProgram>(std::move(arguments));
    program->WaitForText("ready socket=");
    return program;
  }
  nlohmann::json Ready() const { return nlohmann::json::parse(host::ReadFile(ready_, kMaxReadyBytes).value()); }
  std::vector<std::string> Arguments(const std::string& listen = "127.0.0.1:0",
                                     const std::string& http = "127.0.0.1:0") const {
    return {"--listen", listen, "--metrics-listen", http, "--state-dir", folder_.path() + "/state"};
  }

  host::TemporaryFolder folder_;
  std::string ready_ = folder_.path() + "/ready.json";
};

TEST_F(ProgramTest, KeepsItsHostsOverAKillAndEndsInOrder) {
  for (const bool first : {true, false}) {
    const auto program = Start(Arguments());
    const std::string address = Ready().at("socket");
    const auto hosts = v1::HostService::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
    v1::ListHostsResponse listed;
    grpc::ClientContext listing, adding;
    ASSERT_TRUE(hosts->ListHosts(&listing, {}, &listed).ok());
    if (first) {
      v1::AddHostRequest add;
      add.set_name("alpha");
      v1::AddHostResponse added;
      ASSERT_TRUE(hosts->AddHost(&adding, add, &added).ok());
      program->Signal(SIGKILL);
      EXPECT_EQ(program->Wait().signal, SIGKILL);
      EXPECT_EQ(program->Output().find(added.join_token()), std::string::npos);
    } else {
      ASSERT_EQ(listed.hosts_size(), 1);
      EXPECT_EQ(listed.hosts(0).id(), "host-1");
      program->Signal(SIGTERM);
      EXPECT_TRUE(program->Wait().Clean());
    }
  }
}

TEST_F(ProgramTest, QuotasAreThoseOfTheOptions) {
  for (const bool none : {false, true}) {
    std::vector<std::string> arguments = Arguments();
    if (none) arguments.insert(arguments.end(), {"--visual-quota-mb", "0"});
    const auto program = Start(arguments);
    const auto channel = grpc::CreateChannel(Ready().at("socket"), grpc::InsecureChannelCredentials());
    v1::FindMissingVisualsResponse answer;
    grpc::ClientContext asking;
    ASSERT_TRUE(v1::VisualService::NewStub(channel)->FindMissingVisuals(&asking, {}, &answer).ok());
    EXPECT_EQ(answer.keeps_none(), none);
    program->Signal(SIGTERM);
    EXPECT_TRUE(program->Wait().Clean());
  }
}

TEST_F(ProgramTest, APortInUseIsOneLineAndStatusOne) {
  const auto first = Start(Arguments());
  const nlohmann::json addresses = Ready();
  const std::string grpc_address = addresses.at("grpc"), http_address = addresses.at("http");
  const auto grpc = Start(Arguments(grpc_address));
  EXPECT_EQ(grpc->Wait().code, 1);
  EXPECT_EQ(grpc->Output(), "tessera-control: address " + grpc_address + " is in use (grpc)\n");
  const auto http = Start(Arguments("127.0.0.1:0", http_address));
  EXPECT_EQ(http->Wait().code, 1);
  EXPECT_EQ(http->Output(), "tessera-control: address " + http_address + " is in use (http)\n");
  const auto same_store = Start(Arguments());
  EXPECT_EQ(same_store->Wait().code, 1);
  EXPECT_THAT(same_store->Output(), HasSubstr("is in use by another process\n"));
}

TEST_F(ProgramTest, AnEmptiedStoreBesideCheckpointsIsRefused) {
  const std::string state = folder_.path() + "/state";
  std::filesystem::create_directories(state + "/checkpoints/inst-3/1200");
  const auto refused = Start(Arguments());
  EXPECT_EQ(refused->Wait().code, 1);
  EXPECT_EQ(refused->Output(), "tessera-control: " + state + "/checkpoints holds checkpoints of inst-3, but " + state +
                                   "/control.db is empty: put the store back, or, for a new cluster, move the "
                                   "checkpoints away\n");
  std::filesystem::rename(state + "/checkpoints/inst-3", folder_.path() + "/inst-3");
  EXPECT_TRUE(std::filesystem::exists(folder_.path() + "/inst-3/1200"));
  const auto taken = Start(Arguments());
  taken->Signal(SIGTERM);
  EXPECT_TRUE(taken->Wait().Clean());
}

TEST_F(ProgramTest, TheStoreOfAnotherClusterBesideCheckpointsIsRefused) {
  const std::string state = folder_.path() + "/state", other = folder_.path() + "/other";
  for (const std::string& folder : {other, state}) {
    const auto program = Start({"--listen", "127.0.0.1:0", "--metrics-listen", "127.0.0.1:0", "--state-dir", folder});
    program->Signal(SIGTERM);
    EXPECT_TRUE(program->Wait().Clean());
  }
  std::filesystem::create_directories(state + "/checkpoints/inst-3/1200");
  std::filesystem::rename(state + "/control.db", folder_.path() + "/ours.db");
  std::filesystem::copy_file(other + "/control.db", state + "/control.db");
  const auto refused = Start(Arguments());
  EXPECT_EQ(refused->Wait().code, 1);
  EXPECT_THAT(refused->Output(), HasSubstr("tessera-control: " + state + "/checkpoints holds checkpoints of cluster "));
  EXPECT_THAT(refused->Output(), HasSubstr(", inst-3 among them, but " + state + "/control.db is that of cluster "));
  std::filesystem::rename(folder_.path() + "/ours.db", state + "/control.db");
  const auto taken = Start(Arguments());
  taken->Signal(SIGTERM);
  EXPECT_TRUE(taken->Wait().Clean());
}

TEST_F(ProgramTest, ABackupThatIsNotThereIsNamedAndNothingIsMade) {
  const std::string backup = folder_.path() + "/none.tessera";
  std::vector<std::string> arguments = Arguments();
  arguments.insert(arguments.end(), {"--restore", backup});
  const auto refused = Start(arguments);
  EXPECT_EQ(refused->Wait().code, 1);
  EXPECT_EQ(refused->Output(), "tessera-control: --restore: " + backup + ": No such file or directory\n");
  EXPECT_FALSE(std::filesystem::exists(folder_.path() + "/state"));
}

TEST_F(ProgramTest, CheckpointsOfWorldsThatItDoesNotKnowAreNamedCountedAndKept) {
  const std::string state = folder_.path() + "/state", stray = state + "/checkpoints/inst-3/1200";
  for (const bool first : {true, false}) {
    const auto program = Start(Arguments());
    if (!first) {
      program->WaitForText("checkpoints of worlds that the store does not know worlds=1: inst-3;");
      EXPECT_TRUE(std::filesystem::exists(stray));
    }
    const auto channel = grpc::CreateChannel(Ready().at("socket"), grpc::InsecureChannelCredentials());
    v1::AddHostRequest add;
    add.set_name("alpha");  // else the store is empty
    v1::AddHostResponse added;
    grpc::ClientContext adding;
    EXPECT_EQ(v1::HostService::NewStub(channel)->AddHost(&adding, add, &added).ok(), first);
    program->Signal(SIGTERM);
    EXPECT_TRUE(program->Wait().Clean());
    std::filesystem::create_directories(stray);
  }
}

TEST_F(ProgramTest, AnEtcdThatDoesNotAnswerIsAnErrorAndStaysOneLine) {
  const std::vector<std::string> arguments{
      "--metrics-listen", "127.0.0.1:0",        "--state-dir",   folder_.path(),
      "--store",          "etcd://127.0.0.1:1", "--checkpoints", folder_.path() + "/checkpoints"};
  const auto program = Start(arguments);
  ASSERT_TRUE(program->WaitForText("etcd cannot be used, and this control plane cannot lead: start it: "))
      << program->Output();
  program->Signal(SIGTERM);
  EXPECT_TRUE(program->Wait().Clean());
}

TEST_F(ProgramTest, WrongUsageIsStatusTwo) {
  const auto no_folder = Start({});
  EXPECT_EQ(no_folder->Wait().code, 2);
  EXPECT_THAT(no_folder->Output(), HasSubstr("--state-dir is required"));
  const auto no_address = Start(Arguments("nowhere"));
  EXPECT_EQ(no_address->Wait().code, 2);
  EXPECT_THAT(no_address->Output(), HasSubstr("--listen: \"nowhere\" is not of the form HOST:PORT"));
}

}  // namespace
}  // namespace tessera::control
