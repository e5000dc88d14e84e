#include "bench/people_node.h"

#include <chrono>

#include "absl/strings/str_cat.h"
#include "host/files.h"
#include "host/last_lines.h"
#include "host/temporary_folder.h"
#include "local_cluster/command_error.h"

namespace tessera::bench {
namespace {

constexpr std::chrono::minutes kBrowserPatience{10};
constexpr std::size_t kMaxFigures_bytes = 1 << 20;
constexpr const char* kInWeb = "cd \"$0\" && exec node \"$@\"";
constexpr const char* kBundles = "build/measure";

}  // namespace

host::ChildProcess StartNode(const std::vector<std::string>& arguments, const std::string& log,
                             const std::string& out) {
  std::vector<std::string> argv{"/bin/sh", "-c", kInWeb, TESSERA_SOURCE_DIR "/web"};
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  return local::OrThrow(host::ChildProcess::Start({.argv = argv, .log_path = log, .output_path = out}));
}

std::string RunNode(const std::vector<std::string>& arguments) {
  const host::TemporaryFolder folder;
  const std::string out = folder.path() + "/out", log = folder.path() + "/log";
  host::ChildProcess node = StartNode(arguments, log, out);
  const auto ended = node.Wait(kBrowserPatience);
  if (!ended || !ended->Clean()) {
    throw local::CommandError(absl::StrCat("node ", arguments.front(), " ",
                                           ended ? ended->Describe() : "takes too long", host::LastLinesText(log, 8)));
  }
  return local::OrThrow(host::ReadFile(out, kMaxFigures_bytes));
}

void BundlePrograms() { RunNode({"build.mjs", "--tests", kBundles}); }

std::string Bundled(const std::string& program) { return absl::StrCat(kBundles, "/", program); }

}  // namespace tessera::bench
