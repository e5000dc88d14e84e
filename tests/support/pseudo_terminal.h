// PseudoTerminal: a program that runs in a terminal, for what it does by keys.
//
//   PseudoTerminal terminal({BinaryPath("tessera"), "client", "--play", file});
//   ASSERT_TRUE(terminal.Until("playing", 10s));
//   terminal.Type(" ");
//   EXPECT_EQ(terminal.WaitForEnd(10s), 0);
//
// The program is killed with the object. Thread rule: one thread.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tessera::support {

class PseudoTerminal {
 public:
  // Throws std::runtime_error where there is no terminal to be had. A program that cannot be started ends with 127.
  explicit PseudoTerminal(std::vector<std::string> arguments);
  ~PseudoTerminal();
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  void Type(std::string_view bytes);
  // Whether it has written the text, or writes it within `timeout`; what it wrote up to there does not count again.
  bool Until(std::string_view text, std::chrono::milliseconds timeout);
  // The exit code; nothing if it goes on, or a signal ended it.
  std::optional<int> WaitForEnd(std::chrono::milliseconds timeout);
  const std::string& output() const { return output_; }

 private:
  // Takes the output that has come; waits for it at most so long. False once the program has closed its end.
  bool Read(std::chrono::milliseconds timeout);

  int fd_ = -1;
  pid_t pid_ = -1;
  std::string output_;
  std::size_t seen_ = 0;
};

}  // namespace tessera::support
