#include "tests/programs/carry_out.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <utility>

namespace tessera::programs {
namespace {

using ::testing::HasSubstr;

std::string WithoutNumbers(const std::string& text) {
  static const std::regex kNumber("[0-9]+(\\.[0-9]+)?");
  return std::regex_replace(text, kNumber, "#");
}

// As an editor would: the whole file, lines at its end (+), or one line in the place of another (its number).
class Files {
 public:
  explicit Files(std::string folder) : folder_(std::move(folder)) {}

  void Write(const Fenced& block) {
    std::vector<std::string>& lines = files_[block.file];
    if (block.how.empty()) {
      lines = block.lines;
    } else if (block.how == "+") {
      lines.insert(lines.end(), block.lines.begin(), block.lines.end());
    } else {
      EXPECT_EQ(block.lines.size(), 1U);
      lines.at(std::stoul(block.how) - 1) = block.lines.front();
    }
    const std::filesystem::path path = std::filesystem::path(folder_) / block.file;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream out(path);
    for (const std::string& line : lines) out << line << "\n";
    EXPECT_TRUE(out.flush()) << path;
  }

 private:
  const std::string folder_;
  std::map<std::string, std::vector<std::string>> files_;
};

}  // namespace

Carried CarryOut(const std::vector<Fenced>& blocks, Terminal& terminal,
                 const std::function<std::string(const std::string&)>& typed) {
  Files files(terminal.folder());
  Carried carried;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Fenced& block = blocks[i];
    SCOPED_TRACE(block.place);
    if (block.language == "text") continue;  // compared with the block before it
    if (block.language != "sh") {
      EXPECT_NE(block.file, "") << "which file is it?";
      files.Write(block);
      continue;
    }
    const bool shows = i + 1 < blocks.size() && blocks[i + 1].language == "text";
    const std::vector<std::string> expected = shows ? blocks[i + 1].lines : std::vector<std::string>();
    // Errors are shown where there are to be some.
    const bool fails =
        std::ranges::any_of(expected, [](const std::string& line) { return line.starts_with("tessera: "); });
    std::string printed;
    for (const std::string& command : block.lines) {
      const Terminal::Result result = terminal.Type(typed(command));
      EXPECT_EQ(result.clean, !fails) << command << "\n" << result.output;
      printed += result.output;
      ++carried.commands;
    }
    for (const std::string& line : expected) {
      EXPECT_THAT(WithoutNumbers(printed), HasSubstr(WithoutNumbers(line)));
      ++carried.shown;
    }
  }
  return carried;
}

}  // namespace tessera::programs
