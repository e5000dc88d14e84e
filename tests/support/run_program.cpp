#include "tests/support/run_program.h"

#include "host/child_process.h"
#include "host/files.h"
#include "host/temporary_folder.h"

namespace tessera::support {
namespace {

constexpr std::size_t kMaxOutputBytes = std::size_t{1} << 28;

}  // namespace

RunResult RunProgram(const std::string& program, const std::vector<std::string>& arguments,
                     std::chrono::seconds timeout) {
  const host::TemporaryFolder folder;
  const std::string out = folder.path() + "/out", err = folder.path() + "/err";
  std::vector<std::string> argv{BinaryPath(program)};
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  RunResult result;
  auto process = host::ChildProcess::Start({.argv = argv, .log_path = err, .output_path = out});
  if (!process.ok()) {
    result.err = process.status().ToString();
    return result;
  }
  if (const auto ended = process->Wait(timeout); ended && ended->signal == 0) result.exit_code = ended->code;
  process->End(std::chrono::seconds(10));
  result.out = host::ReadFile(out, kMaxOutputBytes).value_or("");
  result.err = host::ReadFile(err, kMaxOutputBytes).value_or("");
  return result;
}

std::string BinaryPath(const std::string& program) { return std::string(TESSERA_BINARY_DIR) + "/bin/" + program; }

std::string ScenePath(const std::string& name) {
  return std::string(TESSERA_SOURCE_DIR) + "/scenes/" + name + ".textproto";
}

}  // namespace tessera::support
