#include "cli/keys.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <utility>

namespace tessera::cli {
namespace {

struct Sequence {
  std::string_view bytes;
  Key key;
};
constexpr std::array<Sequence, 19> kSequences{{
    {" ", Key::kSpace},      {",", Key::kComma},      {".", Key::kPeriod},     {"q", Key::kQ},
    {"Q", Key::kQ},          {"\x1b[D", Key::kLeft},  {"\x1b[C", Key::kRight}, {"\x1b[A", Key::kUp},
    {"\x1b[B", Key::kDown},  {"\x1b[H", Key::kHome},  {"\x1b[F", Key::kEnd},   {"\x1bOD", Key::kLeft},
    {"\x1bOC", Key::kRight}, {"\x1bOA", Key::kUp},    {"\x1bOB", Key::kDown},  {"\x1bOH", Key::kHome},
    {"\x1bOF", Key::kEnd},   {"\x1b[1~", Key::kHome}, {"\x1b[4~", Key::kEnd},
}};
constexpr std::size_t kLongest = 4;

}  // namespace

std::vector<Key> TakeKeys(std::string& bytes) {
  std::vector<Key> keys;
  std::string_view rest = bytes;
  while (!rest.empty()) {
    const Sequence* found = nullptr;
    bool begins = false;
    for (const Sequence& sequence : kSequences) {
      if (rest.starts_with(sequence.bytes)) found = &sequence;
      begins = begins || sequence.bytes.starts_with(rest.substr(0, kLongest));
    }
    if (found != nullptr) {
      keys.push_back(found->key);
      rest.remove_prefix(found->bytes.size());
    } else if (begins) {
      break;
    } else {
      rest.remove_prefix(1);
    }
  }
  bytes.erase(0, bytes.size() - rest.size());
  return keys;
}

KeyReader::KeyReader() {
  termios now{};
  if (isatty(STDIN_FILENO) == 0 || tcgetattr(STDIN_FILENO, &now) != 0) return;
  before_ = now;
  now.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  now.c_cc[VMIN] = 0;
  now.c_cc[VTIME] = 0;
  tcsetattr(STDIN_FILENO, TCSANOW, &now);
}

KeyReader::~KeyReader() {
  if (before_) tcsetattr(STDIN_FILENO, TCSANOW, &*before_);
}

std::vector<Key> KeyReader::Take() {
  if (!before_) return {};
  pollfd watch{STDIN_FILENO, POLLIN, 0};
  std::array<char, 64> buffer{};
  while (poll(&watch, 1, 0) > 0) {
    const ssize_t got = read(STDIN_FILENO, buffer.data(), buffer.size());
    if (got <= 0) break;
    bytes_.append(buffer.data(), static_cast<std::size_t>(got));
  }
  return TakeKeys(bytes_);
}

}  // namespace tessera::cli
