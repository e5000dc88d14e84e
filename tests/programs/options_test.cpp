// One name for one option: docs/options.md against the real programs, and old names against the real programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <sstream>
#include <utility>

#include "host/files.h"
#include "host/renamed_options.h"
#include "tests/programs/program_help.h"
#include "tests/support/run_program.h"

namespace tessera::programs {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Key;

constexpr std::size_t kMaxDocumentBytes = 1 << 20;

// A row of a table "| option | programs | default | meaning |".
struct OptionRow {
  std::vector<std::string> options, programs, defaults;
};

// The texts between backticks in a cell.
std::vector<std::string> Quoted(const std::string& cell) {
  static const std::regex kQuoted("`([^`]*)`");
  std::vector<std::string> quoted;
  for (std::sregex_iterator it(cell.begin(), cell.end(), kQuoted), end; it != end; ++it) quoted.push_back((*it)[1]);
  return quoted;
}

// "`tessera instance create`, `delete`": a name without "tessera" replaces the last word of the one before.
std::vector<std::string> Programs(const std::string& cell) {
  std::vector<std::string> programs;
  for (const std::string& name : Quoted(cell)) {
    const bool whole = name.rfind("tessera", 0) == 0;
    programs.push_back(whole ? name : programs.back().substr(0, programs.back().rfind(' ') + 1) + name);
  }
  return programs;
}

std::vector<OptionRow> ReadRows() {
  const auto text = host::ReadFile(std::string(TESSERA_SOURCE_DIR) + "/docs/options.md", kMaxDocumentBytes);
  std::istringstream lines(text.value());
  std::vector<OptionRow> rows;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("| `-", 0) != 0) continue;
    std::vector<std::string> cells;
    std::istringstream stream(line.substr(1));
    for (std::string cell; std::getline(stream, cell, '|');) cells.push_back(cell);
    if (cells.size() == 4) rows.push_back({Quoted(cells[0]), Programs(cells[1]), Quoted(cells[2])});
  }
  return rows;
}

TEST(OptionsTest, ProgramsHaveWhatTheDocumentLists) {
  const std::vector<OptionRow> rows = ReadRows();
  ASSERT_GT(rows.size(), 50U);
  for (const OptionRow& row : rows) {
    ASSERT_FALSE(row.programs.empty()) << row.options.front();
    for (const std::string& program : row.programs) {
      for (const std::string& option : row.options) {
        ASSERT_THAT(HelpOf(program).options, Contains(Key(option))) << program;
        for (const std::string& value : row.defaults) {
          EXPECT_THAT(HelpOf(program).options.at(option), HasSubstr(value)) << program << " " << option;
        }
      }
    }
  }
}

TEST(OptionsTest, TheDocumentListsWhatProgramsHave) {
  std::set<std::pair<std::string, std::string>> listed;
  for (const OptionRow& row : ReadRows()) {
    for (const std::string& program : row.programs) {
      for (const std::string& option : row.options) listed.emplace(program, option);
    }
  }
  for (const std::string& command : AllCommands()) {
    for (const auto& [option, about] : HelpOf(command).options) {
      if (option == "-h" || option == "--help") continue;
      EXPECT_THAT(listed, Contains(std::pair(command, option))) << "docs/options.md lacks it";
    }
  }
}

TEST(OptionsTest, EveryOldNameIsRefusedWithTheNewOne) {
  for (const host::RenamedOption& renamed : host::kRenamedOptions) {
    const std::string old_name(renamed.old_name), new_name(renamed.new_name);
    for (const std::string& command : AllCommands()) {
      EXPECT_THAT(HelpOf(command).options, testing::Not(Contains(Key(old_name)))) << command;
    }
    for (const char* program : {"tessera", "tessera-control", "tessera-agent", "tessera-region", "tessera-gateway"}) {
      const support::RunResult result = support::RunProgram(program, {old_name, "1"});
      EXPECT_EQ(result.exit_code, 2) << program << " " << old_name;
      EXPECT_EQ(result.err, std::string(program) + ": " + old_name + " is called " + new_name + " now\n");
    }
  }
  const support::RunResult demo = support::RunProgram("tessera", {"demo", "--json"});
  EXPECT_EQ(demo.exit_code, 2);
  EXPECT_EQ(demo.err, "tessera: --json is called -o json now\n");
}

}  // namespace
}  // namespace tessera::programs
