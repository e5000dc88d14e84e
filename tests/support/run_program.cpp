#include "tests/support/run_program.h"

#include <filesystem>
#include <fstream>

#include "local_cluster/local_cluster.h"

namespace tessera::support {
namespace {

std::string ReadAll(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

RunResult RunProgram(const std::string& program, const std::vector<std::string>& arguments,
                     std::chrono::seconds timeout) {
  const local::TemporaryFolder folder;
  const std::string out = folder.path() + "/out", err = folder.path() + "/err";
  std::vector<std::string> argv{BinaryPath(program)};
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  RunResult result;
  local::ChildProcess process(argv, err, out);
  if (const auto ended = process.Wait(timeout); ended && ended->signal == 0) result.exit_code = ended->code;
  process.End(std::chrono::seconds(10));
  result.out = ReadAll(out);
  result.err = ReadAll(err);
  return result;
}

std::string BinaryPath(const std::string& program) { return std::string(TESSERA_BINARY_DIR) + "/bin/" + program; }

std::string ScenePath(const std::string& name) {
  return std::string(TESSERA_SOURCE_DIR) + "/scenes/" + name + ".textproto";
}

}  // namespace tessera::support
