#include "game_sdk/tools/lua_tokens.h"

#include <algorithm>
#include <array>
#include <string>

namespace tessera::game {
namespace {

constexpr std::array<std::string_view, 22> kWords = {
    "and", "break", "do",  "else", "elseif", "end",    "false",  "for",  "function", "goto",  "if",
    "in",  "local", "nil", "not",  "or",     "repeat", "return", "then", "true",     "until", "while"};
// Signs of more than one letter; the longest that fits is taken.
constexpr std::array<std::string_view, 10> kLongSigns = {"...", "..", "==", "~=", "<=", ">=", "//", "::", "<<", ">>"};

bool IsLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool IsDigit(char c) { return c >= '0' && c <= '9'; }

class TokenReader {
 public:
  explicit TokenReader(std::string_view source) : source_(source) {}

  LuaToken Next() {
    SkipBlanks();
    const std::size_t begin = at_;
    if (at_ >= source_.size()) return {LuaTokenKind::kEnd, line_, {}};
    const char first = source_[at_];
    if (IsLetter(first)) return Name();
    if (IsDigit(first) || (first == '.' && IsDigit(Peek(1)))) return Number();
    if (first == '"' || first == '\'') return Quoted();
    if (const std::size_t level = LongLevel(at_); level != std::string_view::npos) {
      const int line = line_;
      return {LuaTokenKind::kText, line, Long(level)};
    }
    std::size_t bytes = 1;
    for (const std::string_view sign : kLongSigns) {
      if (source_.substr(at_).starts_with(sign)) bytes = std::max(bytes, sign.size());
    }
    at_ += bytes;
    return {LuaTokenKind::kSign, line_, source_.substr(begin, bytes)};
  }

 private:
  char Peek(std::size_t ahead) const { return at_ + ahead < source_.size() ? source_[at_ + ahead] : '\0'; }

  void SkipBlanks() {
    while (at_ < source_.size()) {
      if (source_[at_] == '\n') ++line_;
      if (source_.substr(at_).starts_with("--")) {
        at_ += 2;
        if (const std::size_t level = LongLevel(at_); level != std::string_view::npos) {
          Long(level);
        } else {
          at_ = std::min(source_.find('\n', at_), source_.size());
        }
      } else if (std::string_view(" \t\r\n\v\f").find(source_[at_]) != std::string_view::npos) {
        ++at_;
      } else {
        return;
      }
    }
  }

  LuaToken Name() {
    const std::size_t begin = at_;
    while (at_ < source_.size() && (IsLetter(source_[at_]) || IsDigit(source_[at_]))) ++at_;
    const std::string_view text = source_.substr(begin, at_ - begin);
    const bool word = std::ranges::find(kWords, text) != kWords.end();
    return {word ? LuaTokenKind::kWord : LuaTokenKind::kName, line_, text};
  }

  LuaToken Number() {
    const std::size_t begin = at_;
    const bool hex = Peek(0) == '0' && (Peek(1) == 'x' || Peek(1) == 'X');
    while (at_ < source_.size()) {
      const char c = source_[at_];
      const char before = at_ > begin ? source_[at_ - 1] : '\0';
      const bool exponent = hex ? before == 'p' || before == 'P' : before == 'e' || before == 'E';
      if (!IsLetter(c) && !IsDigit(c) && c != '.' && !(exponent && (c == '+' || c == '-'))) break;
      ++at_;
    }
    return {LuaTokenKind::kNumber, line_, source_.substr(begin, at_ - begin)};
  }

  LuaToken Quoted() {
    const char quote = source_[at_++];
    const std::size_t begin = at_;
    const int line = line_;
    while (at_ < source_.size() && source_[at_] != quote) {
      if (source_[at_] == '\\') ++at_;
      if (at_ < source_.size() && source_[at_] == '\n') ++line_;
      ++at_;
    }
    const std::string_view text = source_.substr(begin, std::min(at_, source_.size()) - begin);
    ++at_;
    return {LuaTokenKind::kText, line, text};
  }

  // The number of equal signs of a long bracket that opens at `at`; npos if none does.
  std::size_t LongLevel(std::size_t at) const {
    if (at >= source_.size() || source_[at] != '[') return std::string_view::npos;
    const std::size_t end = source_.find_first_not_of('=', at + 1);
    return end != std::string_view::npos && source_[end] == '[' ? end - at - 1 : std::string_view::npos;
  }

  std::string_view Long(std::size_t level) {
    at_ += level + 2;
    const std::string close = "]" + std::string(level, '=') + "]";
    const std::size_t begin = at_, end = std::min(source_.find(close, at_), source_.size());
    const std::string_view text = source_.substr(begin, end - begin);
    line_ += static_cast<int>(std::ranges::count(text, '\n'));
    at_ = std::min(end + close.size(), source_.size());
    return text;
  }

  std::string_view source_;
  std::size_t at_ = 0;
  int line_ = 1;
};

}  // namespace

std::vector<LuaToken> LuaTokens(std::string_view source) {
  TokenReader reader(source);
  std::vector<LuaToken> tokens;
  do {
    tokens.push_back(reader.Next());
  } while (tokens.back().kind != LuaTokenKind::kEnd);
  return tokens;
}

}  // namespace tessera::game
