// MessageParts: one text of a WebSocket out of the parts that it comes in, and never more of it than a viewer may send.
//
//   if (first) parts.Begin();
//   parts.Add(bytes);
//   if (last && parts.too_long()) Refuse(); else if (last) Take(parts.text());
//
// Thread rule: one thread.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace tessera::gateway {

class MessageParts {
 public:
  explicit MessageParts(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  void Begin() {
    text_.clear();
    too_long_ = false;
  }
  // Keeps nothing of a message that is too long.
  void Add(std::string_view bytes) {
    too_long_ = too_long_ || text_.size() + bytes.size() > most_bytes_;
    if (too_long_) {
      text_.clear();
    } else {
      text_.append(bytes);
    }
  }

  bool too_long() const { return too_long_; }
  const std::string& text() const { return text_; }  // empty for one that is too long

 private:
  std::size_t most_bytes_;
  std::string text_;
  bool too_long_ = false;
};

}  // namespace tessera::gateway
