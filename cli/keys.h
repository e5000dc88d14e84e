// KeyReader: the keys that somebody presses in a terminal, one by one, without Return.
//
// Does nothing where the standard input is no terminal (a pipe, a file, a service), so that scripts and tests go on.
// While it lives the terminal neither waits for whole lines nor shows what is typed; Ctrl-C works as always. Thread
// rule: one thread; one at a time in a process.
#pragma once

#include <termios.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tessera::cli {

enum class Key { kSpace, kLeft, kRight, kUp, kDown, kHome, kEnd, kComma, kPeriod, kQ };

// Takes the keys out of what a terminal sent, as xterm and Linux's console write them; what is no such key is dropped,
// an escape sequence that may not have come whole stays in `bytes`.
std::vector<Key> TakeKeys(std::string& bytes);

class KeyReader {
 public:
  KeyReader();
  ~KeyReader();
  KeyReader(const KeyReader&) = delete;
  KeyReader& operator=(const KeyReader&) = delete;

  bool reads() const { return before_.has_value(); }
  // Those since the last call; never waits.
  std::vector<Key> Take();

 private:
  std::optional<termios> before_;  // how the terminal was set
  std::string bytes_;
};

}  // namespace tessera::cli
