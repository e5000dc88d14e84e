#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/text_format.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/world/json_place.h"
#include "core/world/limits.h"
#include "core/world/scene_io.h"
#include "core/world/utf8.h"

namespace tessera {
namespace {

// Scene > Body > Shape > Compound > Child > Shape > Hull > Vec3, with room.
constexpr int kMaxDepth = 32;

// The message of a parser in one line.
std::string OneLine(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  return text;
}

// Keeps the first error and its place.
class FirstError : public google::protobuf::io::ErrorCollector {
 public:
  explicit FirstError(std::string file) : file_(std::move(file)) {}

  // Both from 0; -1 where the parser does not know.
  void AddError(int line, int column, const std::string& message) override {
    if (!text_.empty()) return;
    const std::string place = line < 0 ? file_ : absl::StrCat(file_, ":", line + 1, ":", column + 1);
    text_ = absl::StrCat(place, ": ", OneLine(message));
  }
  const std::string& text() const { return text_; }

 private:
  std::string file_, text_;
};

absl::StatusOr<v1::Scene> ParseText(const std::string& text, const std::string& file) {
  v1::Scene scene;
  FirstError error(file);
  google::protobuf::TextFormat::Parser parser;
  parser.RecordErrorsTo(&error);
  parser.SetRecursionLimit(kMaxDepth);
  if (parser.ParseFromString(text, &scene)) return scene;
  return absl::InvalidArgumentError(error.text().empty() ? absl::StrCat(file, ": not a textproto scene")
                                                         : error.text());
}

// ":LINE:COLUMN" of a position in a text, both from 1.
std::string LineAndColumn(std::string_view text, std::size_t at) {
  const std::string_view before = text.substr(0, at);
  const auto line = 1 + std::ranges::count(before, '\n');
  return absl::StrCat(":", line, ":", at - (before.rfind('\n') + 1) + 1);  // npos + 1 is 0
}

// Where the field is that a JSON error of protobuf names: "(bodies[1].mass): invalid value ...", or, of one that there
// is not, "(bodies[1]) mas: Cannot find field.", without the first part at the top. Empty if it cannot be found.
std::string PlaceOfField(std::string_view text, std::string_view message) {
  std::string path;
  if (message.starts_with('(')) {
    const std::size_t end = message.find(')');
    if (end == std::string_view::npos) return "";
    path = message.substr(1, end - 1);
    message.remove_prefix(end + 1);
    if (message.starts_with(' ')) message.remove_prefix(1);
  }
  const std::string_view name = message.substr(0, message.find(": "));
  if (!path.empty() && !name.empty()) path += '.';
  path += name;
  const auto place = JsonPlace(text, path);
  return place ? LineAndColumn(text, *place) : "";
}

// A JSON error of protobuf 3.21 is either one line, about a field, or three parts: what, the text around the place
// (which may hold line ends), and a caret under the place. The place in the file is where that text occurs.
std::string DescribeJsonError(const std::string& text, const std::string& file, const std::string& message) {
  const std::size_t first = message.find('\n'), last = message.rfind('\n');
  if (first == last || message.back() != '^') {
    return absl::StrCat(file, PlaceOfField(text, message), ": ", OneLine(message));
  }
  const std::string what = message.substr(0, first);
  const std::string around = message.substr(first + 1, last - first - 1);
  const std::size_t offset = message.size() - last - 2;  // position of the caret
  const std::size_t found = text.find(around);
  if (found == std::string::npos || text.find(around, found + 1) != std::string::npos) {
    return absl::StrCat(file, ": ", OneLine(what), " near: ", OneLine(around));
  }
  return absl::StrCat(file, LineAndColumn(text, found + offset), ": ", OneLine(what));
}

absl::StatusOr<v1::Scene> ParseJson(const std::string& text, const std::string& file) {
  v1::Scene scene;
  const auto status = google::protobuf::util::JsonStringToMessage(text, &scene);
  if (status.ok()) return scene;
  return absl::InvalidArgumentError(DescribeJsonError(text, file, status.message().ToString()));
}

// Why a file cannot be a scene, whatever its syntax; empty if it may be one. A parser would name a byte of it that says
// nothing to whoever took the wrong file.
std::string WhyNoScene(std::string_view text, const std::string& file) {
  if (text.starts_with("glTF") || absl::EndsWithIgnoreCase(file, ".gltf")) {
    return "is a glTF level; tessera scene import makes a scene of it";
  }
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) return "is empty";
  if (text.find('\0') != std::string_view::npos || !IsUtf8(text)) {
    return "is not text in UTF-8; a scene is JSON, or protobuf's text format";
  }
  return "";
}

}  // namespace

absl::StatusOr<v1::Scene> ParseScene(std::string_view text, std::string_view file) {
  const google::protobuf::LogSilencer silence;  // errors are returned, not also printed
  const std::string name(file);
  if (text.size() > kMaxSceneText) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": at most ", kMaxSceneText, " bytes, got ", text.size()));
  }
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // some editors begin a file with it
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  if (const std::string why = WhyNoScene(text, name); !why.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": ", why));
  }
  const bool json = text[text.find_first_not_of(" \t\r\n")] == '{';
  return json ? ParseJson(std::string(text), name) : ParseText(std::string(text), name);
}

}  // namespace tessera
