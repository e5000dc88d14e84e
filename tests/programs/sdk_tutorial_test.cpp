// docs/sdk.md: its first client is made word for word, against an installed package in a folder of its own, and every
// other piece of C and C++ on the page compiles.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "host/temporary_folder.h"
#include "tests/programs/carry_out.h"
#include "tests/programs/documents.h"
#include "tests/programs/terminal.h"

namespace tessera::programs {
namespace {

constexpr const char* kSdk = "docs/sdk.md";
constexpr const char* kFirstClient = "A first client";
constexpr const char* kPrefix = "/opt/tessera";  // where the page has it installed

// All that a piece of the page takes from the program around it.
constexpr const char* kAroundC = R"(
void draw_bar(int64_t); void draw_score(int64_t); void show_points(int64_t); void draw_text(const char*);
void piece(tessera_client* client, const void* grant, size_t grant_size, const float* force, tessera_body* bodies,
           size_t capacity, int64_t now, uint64_t id, float right, float forward, float camera_yaw, int jump_pressed,
           tessera_steering steering, tessera_local_options options, const char* scene_text, const char* game_text);
void piece(tessera_client* client, const void* grant, size_t grant_size, const float* force, tessera_body* bodies,
           size_t capacity, int64_t now, uint64_t id, float right, float forward, float camera_yaw, int jump_pressed,
           tessera_steering steering, tessera_local_options options, const char* scene_text, const char* game_text) {
)";
constexpr const char* kAroundCpp = R"(
void DrawBar(std::int64_t); void DrawText(const char*); void Draw(std::uint64_t, const double*, const double*);
int Fail(const std::string&);
int Piece(tessera::Client& client, const std::string& address, std::uint64_t id, float fx, float fz);
int Piece(tessera::Client& client, const std::string& address, std::uint64_t id, float fx, float fz) {
)";

// The piece as a file that compiles by itself.
std::string Compilable(const Fenced& block) {
  const bool c = block.language == "c";
  std::string included = c ? "#include <stdio.h>\n#include <string.h>\n"
                           : "#include <string>\n#include <variant>\n#include <tessera/connect.hpp>\n";
  included += "#include <tessera/connect.h>\n#include <tessera/local.h>\n#include \"car_movement.h\"\n";
  std::string inside;
  for (const std::string& line : block.lines) (line.rfind("#include", 0) == 0 ? included : inside) += line + "\n";
  return included + (c ? kAroundC : kAroundCpp) + "{\n" + inside + "}\n" + (c ? "}\n" : "return 0; }\n");
}

TEST(SdkTutorialTest, TheFirstClientIsMadeWordForWordAndPlays) {
  const host::TemporaryFolder installed;
  Terminal terminal;
  terminal.Run(std::string(TESSERA_CMAKE " --install " TESSERA_BINARY_DIR " --component sdk --prefix ") +
               installed.path());
  std::vector<Fenced> blocks;
  for (const Fenced& block : ReadFenced(kSdk)) {
    if (block.section == kFirstClient) blocks.push_back(block);
  }
  const Carried carried = CarryOut(blocks, terminal, [&](std::string command) {
    const std::size_t at = command.find(kPrefix);
    return at == std::string::npos ? command : command.replace(at, std::string(kPrefix).size(), installed.path());
  });
  EXPECT_EQ(carried.commands, 4);
  EXPECT_EQ(carried.shown, 2);
}

TEST(SdkTutorialTest, EveryOtherPieceCompiles) {
  const host::TemporaryFolder folder;
  Terminal terminal;
  int pieces = 0;
  for (const Fenced& block : ReadFenced(kSdk)) {
    if (!block.file.empty() || (block.language != "c" && block.language != "cpp")) continue;
    SCOPED_TRACE(block.place);
    const std::string name = folder.path() + "/piece." + block.language;
    std::ofstream(name) << Compilable(block);
    const std::string compiler = block.language == "c" ? "cc -std=c99" : "c++ -std=c++17";
    terminal.Run(compiler +
                 " -fsyntax-only -Wall -Wextra -Wno-unused -Werror -I" TESSERA_SOURCE_DIR
                 "/client_sdk/include -I" TESSERA_SOURCE_DIR "/game_sdk/include -I" TESSERA_SOURCE_DIR
                 "/game_sdk/examples/car " +
                 name);
    ++pieces;
  }
  EXPECT_GT(pieces, 10);
}

}  // namespace
}  // namespace tessera::programs
