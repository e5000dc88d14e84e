// tessera-control as a process: readiness, one-line errors, an end in order, and its store after a kill.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tessera/v1/host.grpc.pb.h"

extern char** environ;

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

// A child whose standard error and ready line come through pipes. Killed and reaped at the end, by its pid.
class Program {
 public:
  explicit Program(std::vector<std::string> arguments) {
    int ready[2], errors[2];
    if (pipe(ready) != 0 || pipe(errors) != 0) abort();
    arguments.insert(arguments.begin(), TESSERA_CONTROL_PROGRAM);
    arguments.insert(arguments.end(), {"--ready-fd", "3"});
    std::vector<char*> argv;
    argv.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    // Read ends are closed in the child first: one of them may be descriptor 3.
    posix_spawn_file_actions_addclose(&actions, ready[0]);
    posix_spawn_file_actions_addclose(&actions, errors[0]);
    posix_spawn_file_actions_adddup2(&actions, errors[1], 2);
    posix_spawn_file_actions_adddup2(&actions, ready[1], 3);
    if (errors[1] != 3) posix_spawn_file_actions_addclose(&actions, errors[1]);
    if (ready[1] != 3) posix_spawn_file_actions_addclose(&actions, ready[1]);
    EXPECT_EQ(posix_spawn(&pid_, argv[0], &actions, nullptr, argv.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
    close(ready[1]);
    close(errors[1]);
    ready_ = ready[0];
    errors_ = errors[0];
  }
  ~Program() {
    if (pid_ > 0) End(SIGKILL);
    close(ready_);
    close(errors_);
  }

  // Waits for the ready line or the program's end, then empty.
  std::string ReadyLine() { return ReadAll(ready_); }
  std::string Errors() { return ReadAll(errors_); }
  int End(int signal) {
    kill(pid_, signal);
    return Wait();
  }
  int Wait() {
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

 private:
  static std::string ReadAll(int fd) {
    std::string text;
    char buffer[4096];
    for (ssize_t n = 0; (n = read(fd, buffer, sizeof buffer)) > 0;) text.append(buffer, static_cast<std::size_t>(n));
    return text;
  }
  pid_t pid_ = -1;
  int ready_ = -1, errors_ = -1;
};

class ProgramTest : public ::testing::Test {
 protected:
  ProgramTest() {
    std::string folder = (std::filesystem::temp_directory_path() / "tessera-program-XXXXXX").string();
    folder_ = ::mkdtemp(folder.data());
  }
  ~ProgramTest() override { std::filesystem::remove_all(folder_); }
  std::vector<std::string> Arguments(const std::string& listen = "127.0.0.1:0",
                                     const std::string& http = "127.0.0.1:0") const {
    return {"--listen", listen, "--http", http, "--data-dir", folder_ + "/data"};
  }

  std::string folder_;
};

TEST_F(ProgramTest, KeepsItsHostsOverAKillAndEndsInOrder) {
  for (const bool first : {true, false}) {
    Program program(Arguments());
    const std::string address = nlohmann::json::parse(program.ReadyLine()).at("grpc");
    const auto hosts = v1::HostService::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
    v1::ListHostsResponse listed;
    grpc::ClientContext listing, adding;
    ASSERT_TRUE(hosts->ListHosts(&listing, {}, &listed).ok());
    if (first) {
      v1::AddHostRequest add;
      add.set_name("alpha");
      v1::AddHostResponse added;
      ASSERT_TRUE(hosts->AddHost(&adding, add, &added).ok());
      EXPECT_EQ(program.End(SIGKILL), -SIGKILL);
      EXPECT_EQ(program.Errors().find(added.join_token()), std::string::npos);
    } else {
      ASSERT_EQ(listed.hosts_size(), 1);
      EXPECT_EQ(listed.hosts(0).id(), "host-1");
      EXPECT_EQ(program.End(SIGTERM), 0);
    }
  }
}

TEST_F(ProgramTest, APortInUseIsOneLineAndStatusOne) {
  Program first(Arguments());
  const auto addresses = nlohmann::json::parse(first.ReadyLine());
  Program grpc(Arguments(addresses.at("grpc")));
  EXPECT_EQ(grpc.Errors(),
            "tessera-control: address " + addresses.at("grpc").get<std::string>() + " is in use (grpc)\n");
  EXPECT_EQ(grpc.Wait(), 1);
  Program http(Arguments("127.0.0.1:0", addresses.at("http")));
  EXPECT_EQ(http.Errors(),
            "tessera-control: address " + addresses.at("http").get<std::string>() + " is in use (http)\n");
  EXPECT_EQ(http.Wait(), 1);
  Program same_store(Arguments());
  EXPECT_THAT(same_store.Errors(), HasSubstr("is in use by another process\n"));
  EXPECT_EQ(same_store.Wait(), 1);
}

TEST_F(ProgramTest, WrongUsageIsStatusTwo) {
  Program no_folder({});
  EXPECT_THAT(no_folder.Errors(), HasSubstr("--data-dir is required"));
  EXPECT_EQ(no_folder.Wait(), 2);
  Program no_address(Arguments("nowhere"));
  EXPECT_THAT(no_address.Errors(), HasSubstr("address nowhere: needs the form HOST:PORT"));
  EXPECT_EQ(no_address.Wait(), 2);
}

}  // namespace
}  // namespace tessera::control
