#include "host/last_lines.h"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "host/log_rotation.h"

namespace tessera::host {

namespace {

std::vector<std::string> LastLinesOfFile(const std::string& path, std::size_t count) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in) return {};
  const auto size = static_cast<std::size_t>(in.tellg());
  const std::size_t want = std::min(size, count * (kMaxLineBytes + 1));
  in.seekg(static_cast<std::streamoff>(size - want));
  std::string tail(want, '\0');
  in.read(tail.data(), static_cast<std::streamsize>(want));
  tail.resize(static_cast<std::size_t>(in.gcount()));

  std::vector<std::string> lines;
  std::istringstream text(tail);
  for (std::string line; std::getline(text, line);) {
    if (line.size() > kMaxLineBytes) line.resize(kMaxLineBytes);
    for (char& c : line) {
      if (c < ' ' || c > '~') c = c == '\t' ? ' ' : '?';
    }
    lines.push_back(std::move(line));
  }
  if (want < size && lines.size() > 1) lines.erase(lines.begin());  // it begins in the middle of a line
  if (lines.size() > count) lines.erase(lines.begin(), lines.end() - static_cast<std::ptrdiff_t>(count));
  return lines;
}

}  // namespace

std::vector<std::string> LastLines(const std::string& path, std::size_t count) {
  std::vector<std::string> lines = LastLinesOfFile(path, count);
  if (lines.size() >= count) return lines;
  std::vector<std::string> before = LastLinesOfFile(EarlierLog(path, 1), count - lines.size());
  before.insert(before.end(), lines.begin(), lines.end());
  return before;
}

std::string LastLinesText(const std::string& path, std::size_t count) {
  std::string text;
  for (const std::string& line : LastLines(path, count)) text += "\n  " + line;
  return text;
}

}  // namespace tessera::host
