#include "core/world/json_place.h"

#include <charconv>
#include <string>

namespace tessera {
namespace {

// A name of JSON as protobuf names the field: heightField and height_field are one.
std::string SnakeCase(std::string_view name) {
  std::string snake;
  for (const char c : name) {
    const bool upper = c >= 'A' && c <= 'Z';
    if (upper) snake += '_';
    snake += upper ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return snake;
}

// Goes through a text; whatever returns false has met something that is not JSON, or the end.
class Walk {
 public:
  explicit Walk(std::string_view text) : text_(text) {}

  std::size_t at() const { return at_; }

  // From an object to the value of a member; `name_at` is where its name begins.
  bool EnterMember(std::string_view name, std::size_t& name_at) {
    if (!Take('{')) return false;
    while (true) {
      Space();
      name_at = at_;
      const std::size_t begin = at_ + 1;
      if (!SkipString()) return false;
      const std::string_view found = text_.substr(begin, at_ - begin - 1);
      if (!Take(':')) return false;
      Space();
      if (found == name || SnakeCase(found) == name) return true;
      if (!SkipValue() || !Take(',')) return false;
    }
  }

  // From an array to one of its elements.
  bool EnterElement(std::size_t index) {
    if (!Take('[')) return false;
    for (; index > 0; --index) {
      if (!SkipValue() || !Take(',')) return false;
    }
    Space();
    return at_ < text_.size() && text_[at_] != ']';
  }

 private:
  void Space() {
    while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos) ++at_;
  }
  bool Take(char c) {
    Space();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  bool SkipString() {
    if (at_ >= text_.size() || text_[at_] != '"') return false;
    for (++at_; at_ < text_.size(); ++at_) {
      if (text_[at_] == '"') {
        ++at_;
        return true;
      }
      if (text_[at_] == '\\') ++at_;
    }
    return false;
  }
  // Without recursion, for a text may nest without end.
  bool SkipValue() {
    Space();
    std::size_t depth = 0;
    const std::size_t begin = at_;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (depth == 0 && (c == ',' || c == '}' || c == ']')) return at_ > begin;
      if (c == '"') {
        if (!SkipString()) return false;
        continue;
      }
      if (c == '{' || c == '[') ++depth;
      if (c == '}' || c == ']') --depth;
      ++at_;
    }
    return false;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

std::optional<std::size_t> JsonPlace(std::string_view text, std::string_view path) {
  Walk walk(text);
  std::optional<std::size_t> place;
  while (!path.empty()) {
    if (path.front() == '[') {
      std::size_t index = 0;
      const auto read = std::from_chars(path.data() + 1, path.data() + path.size(), index);
      if (read.ec != std::errc() || read.ptr == path.data() + path.size() || *read.ptr != ']') return std::nullopt;
      path.remove_prefix(static_cast<std::size_t>(read.ptr + 1 - path.data()));
      if (!walk.EnterElement(index)) return std::nullopt;
      place = walk.at();
    } else {
      const std::string_view name = path.substr(0, path.find_first_of(".["));
      path.remove_prefix(name.size());
      std::size_t name_at = 0;
      if (name.empty() || !walk.EnterMember(name, name_at)) return std::nullopt;
      place = name_at;
    }
    if (!path.empty() && path.front() == '.') path.remove_prefix(1);
  }
  return place;
}

}  // namespace tessera
