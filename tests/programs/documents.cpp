#include "tests/programs/documents.h"

#include <algorithm>
#include <filesystem>
#include <regex>
#include <sstream>
#include <utility>

#include "host/files.h"

namespace tessera::programs {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxDocumentBytes = 1 << 20;

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::string WithoutComment(const std::string& line) {
  static const std::regex kComment("(^|\\s)#.*");
  return std::regex_replace(line, kComment, "");
}

class Reader {
 public:
  explicit Reader(std::string name) { document_.name = std::move(name); }

  Document Read(std::istream& lines) {
    for (std::string line; std::getline(lines, line); ++number_) {
      if (line.rfind("```", 0) == 0) {
        Fence(line.substr(3));
      } else if (fenced_) {
        BlockLine(line);
      } else {
        TextLine(line);
      }
    }
    EndParagraph();
    return std::move(document_);
  }

 private:
  void Fence(const std::string& language) {
    EndParagraph();
    fenced_ = !fenced_;
    shell_ = fenced_ && language == "sh";
    if (shell_) document_.blocks.emplace_back();
  }
  void BlockLine(const std::string& line) {
    if (!shell_) return Add(document_.unmarked, line);
    pending_ += WithoutComment(line);
    if (!pending_.empty() && pending_.back() == '\\') {
      pending_.back() = ' ';
      return;
    }
    Add(document_.blocks.back(), pending_);
    pending_.clear();
  }
  void TextLine(const std::string& line) {
    const bool indented = line.rfind("    ", 0) == 0;
    if (indented && paragraph_.empty()) return Add(document_.unmarked, line);
    if (line.empty()) return EndParagraph();
    if (paragraph_.empty()) begin_ = number_;
    paragraph_ += line + " ";
  }
  // A command may be broken over two lines of a paragraph.
  void EndParagraph() {
    static const std::regex kQuoted("`([^`]+)`");
    const int end = std::exchange(number_, begin_);
    for (std::sregex_iterator it(paragraph_.begin(), paragraph_.end(), kQuoted), last; it != last; ++it) {
      Add(document_.in_text, (*it)[1]);
    }
    number_ = end;
    paragraph_.clear();
  }
  void Add(std::vector<Command>& commands, const std::string& line) const {
    const std::string text = Joined(SplitWords(line));
    if (!text.empty()) commands.push_back({document_.name + ":" + std::to_string(number_), text});
  }

  Document document_;
  int number_ = 1, begin_ = 1;
  bool fenced_ = false, shell_ = false;
  std::string pending_, paragraph_;
};

}  // namespace

std::vector<std::string> SplitWords(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

Document ReadDocument(const std::string& name) {
  std::istringstream lines(
      host::ReadFile(std::string(TESSERA_SOURCE_DIR) + "/" + name, kMaxDocumentBytes).value_or(""));
  return Reader(name).Read(lines);
}

std::vector<Fenced> ReadFenced(const std::string& name) {
  std::istringstream lines(
      host::ReadFile(std::string(TESSERA_SOURCE_DIR) + "/" + name, kMaxDocumentBytes).value_or(""));
  std::vector<Fenced> blocks;
  bool inside = false;
  int number = 0;
  std::string section;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (!inside && line.rfind("## ", 0) == 0) section = line.substr(3);
    if (line.rfind("```", 0) != 0) {
      if (inside) blocks.back().lines.push_back(line);
      continue;
    }
    inside = !inside;
    if (!inside) continue;
    Fenced& block = blocks.emplace_back();
    block.place = name + ":" + std::to_string(number);
    block.section = section;
    std::istringstream(line.substr(3)) >> block.language >> block.file >> block.how;
  }
  return blocks;
}

std::vector<Document> ReadDocuments() {
  const fs::path root = TESSERA_SOURCE_DIR;
  std::vector<std::string> names{"CONTRIBUTING.md", "README.md"};
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / "docs")) {
    if (entry.path().extension() == ".md") names.push_back(fs::relative(entry.path(), root).string());
  }
  std::sort(names.begin(), names.end());
  std::vector<Document> documents;
  documents.reserve(names.size());
  for (const std::string& name : names) documents.push_back(ReadDocument(name));
  return documents;
}

}  // namespace tessera::programs
