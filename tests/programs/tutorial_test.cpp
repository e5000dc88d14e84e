// docs/tutorial.md, carried out word for word: its files are written, its commands typed, and what it shows is compared
// with what they print, but for numbers.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <string>
#include <vector>

#include "tests/programs/documents.h"
#include "tests/programs/terminal.h"

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
      ASSERT_EQ(block.lines.size(), 1U);
      lines.at(std::stoul(block.how) - 1) = block.lines.front();
    }
    const std::filesystem::path path = std::filesystem::path(folder_) / block.file;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream out(path);
    for (const std::string& line : lines) out << line << "\n";
    ASSERT_TRUE(out.flush()) << path;
  }

 private:
  const std::string folder_;
  std::map<std::string, std::vector<std::string>> files_;
};

TEST(TutorialTest, CarriedOutWordForWordItDoesWhatItSays) {
  Terminal terminal;
  Files files(terminal.folder());
  const std::vector<Fenced> blocks = ReadFenced(kTutorial);
  int commands = 0, shown = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Fenced& block = blocks[i];
    SCOPED_TRACE(block.place);
    if (block.language == "text") continue;  // compared with the block before it
    if (block.language != "sh") {
      ASSERT_NE(block.file, "") << "which file is it?";
      ASSERT_NO_FATAL_FAILURE(files.Write(block));
      continue;
    }
    const bool shows = i + 1 < blocks.size() && blocks[i + 1].language == "text";
    const std::vector<std::string> expected = shows ? blocks[i + 1].lines : std::vector<std::string>();
    // Errors are shown where there are to be some.
    const bool fails =
        std::ranges::any_of(expected, [](const std::string& line) { return line.starts_with("tessera: "); });
    std::string printed;
    for (const std::string& command : block.lines) {
      const Terminal::Result result = terminal.Type(command);
      EXPECT_EQ(result.clean, !fails) << command << "\n" << result.output;
      printed += result.output;
      ++commands;
    }
    for (const std::string& line : expected) {
      EXPECT_THAT(WithoutNumbers(printed), HasSubstr(WithoutNumbers(line)));
      ++shown;
    }
  }
  EXPECT_GT(commands, 15);
  EXPECT_GT(shown, 20);
}

}  // namespace
}  // namespace tessera::programs
