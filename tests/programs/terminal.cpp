#include "tests/programs/terminal.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <regex>
#include <string_view>

#include "host/files.h"

namespace tessera::programs {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMaxOutputBytes = 1 << 24;
// Commands that run until they are stopped.
constexpr std::array<std::string_view, 1> kEndless = {"tessera instance watch"};

}  // namespace

Terminal::Result Terminal::Type(const std::string& text) {
  static const std::regex kSeconds("--seconds [0-9]+");
  auto process = Start(std::regex_replace(text, kSeconds, "--seconds 1"));
  const auto ended = process.Wait(60s);
  process.End(5s);
  return {ended && ended->Clean(), Output()};
}

void Terminal::Run(const std::string& text) {
  if (std::ranges::none_of(kEndless, [&](std::string_view begin) { return text.starts_with(begin); })) {
    const Result result = Type(text);
    EXPECT_TRUE(result.clean) << result.output;
    return;
  }
  auto process = Start(text);
  while (Output().empty() && !process.Wait(20ms)) {
  }
  EXPECT_THAT(Output(), ::testing::Not(::testing::IsEmpty()));
  EXPECT_FALSE(process.Wait(0ms)) << Output();
  process.End(5s);
}

host::ChildProcess Terminal::Start(const std::string& command) {
  std::filesystem::remove(output_);
  const char* path = std::getenv("PATH");
  return host::ChildProcess::Start(
             {.argv = {"/usr/bin/env", "-C", desk_.path(),
                       std::string("PATH=") + TESSERA_BINARY_DIR + "/bin:" + (path != nullptr ? path : ""),
                       "TESSERA_CONTROL=" + cluster_.control_address(), "TESSERA_GATEWAY=" + cluster_.page_address(),
                       "/bin/sh", "-c", "exec " + command},
              .log_path = output_})
      .value();
}

std::string Terminal::Output() const { return host::ReadFile(output_, kMaxOutputBytes).value_or(""); }

}  // namespace tessera::programs
