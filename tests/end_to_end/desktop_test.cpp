// The desktop client under a virtual display and Mesa's software renderer: its screens, a player's keys, its profiler
// against the workers' own pages, and what it says when nothing is there.
#include <gtest/gtest.h>
#include <stb_image.h>

#include <array>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <vector>

#include "host/child_process.h"
#include "host/files.h"
#include "host/temporary_folder.h"
#include "telemetry/http_get.h"
#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {
namespace {

// An X server without a screen; it chooses a free number itself.
class VirtualDisplay {
 public:
  explicit VirtualDisplay(const std::string& folder) {
    const std::string number = folder + "/display";
    auto server = host::ChildProcess::Start(
        {.argv = {"/usr/bin/Xvfb", "-displayfd", "1", "-screen", "0", "800x600x24", "-nolisten", "tcp"},
         .log_path = folder + "/xvfb.log",
         .output_path = number,
         .parent_death_signal = SIGTERM});
    EXPECT_TRUE(server.ok()) << server.status();
    if (!server.ok()) return;
    server_.emplace(*std::move(server));
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    std::string said;
    while (said.find('\n') == std::string::npos && std::chrono::steady_clock::now() < limit) {
      if (server_->Wait(std::chrono::milliseconds(20))) break;  // it has ended: said below
      said = host::ReadFile(number, 64).value_or("");
    }
    EXPECT_NE(said.find('\n'), std::string::npos) << "Xvfb did not start: " << folder << "/xvfb.log";
    setenv("DISPLAY", (":" + said.substr(0, said.find('\n'))).c_str(), 1);
    setenv("SDL_VIDEODRIVER", "x11", 1);
    setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
  }

 private:
  std::optional<host::ChildProcess> server_;
};

// A picture of one colour is small.
constexpr std::uintmax_t kBlankPngBytes = 3000;

class DesktopTest : public WorldTest {
 protected:
  std::string File(const std::string& name) const { return folder_.path() + "/" + name; }
  support::RunResult Client(std::vector<std::string> arguments, const std::string& script) {
    std::ofstream(File("script")) << script;
    arguments.insert(arguments.end(), {"--plain", "--size", "640x360", "--script", File("script")});
    return support::RunProgram("tessera-desktop", arguments, kPatience);
  }
  // A report of the client: the library's figures by their names, and the texts of its panel by their labels.
  struct Report {
    std::map<std::string, double> figures;
    std::map<std::string, std::string> panel;

    // The number that a text of the panel begins with.
    double Shown(const std::string& label) const {
      const auto text = panel.find(label);
      EXPECT_NE(text, panel.end()) << label;
      return text == panel.end() ? std::nan("") : std::atof(text->second.c_str());
    }
    double Figure(const std::string& name) const {
      const auto figure = figures.find(name);
      EXPECT_NE(figure, figures.end()) << name;
      return figure == figures.end() ? std::nan("") : figure->second;
    }
    void ExpectShown(const std::string& label, double expected) const {
      EXPECT_NEAR(Shown(label), expected, kShownWithin * expected) << label;
    }
  };
  static constexpr double kShownWithin = 0.05;

  Report ReadReport(const std::string& name) const {
    constexpr char kPanel[] = "panel ";
    Report report;
    std::istringstream text(host::ReadFile(File(name), std::size_t{1} << 20).value_or(""));
    for (std::string line; std::getline(text, line);) {
      if (line.rfind(kPanel, 0) == 0) {
        const auto end = line.find(": ");
        report.panel[line.substr(sizeof kPanel - 1, end - (sizeof kPanel - 1))] = line.substr(end + 2);
      } else if (const auto space = line.rfind(' '); space != std::string::npos) {
        report.figures[line.substr(0, space)] = std::atof(line.c_str() + space + 1);
      }
    }
    return report;
  }
  void ExpectPicture(const std::string& name) const {
    const std::string bytes = host::ReadFile(File(name), std::size_t{1} << 26).value_or("");
    EXPECT_EQ(bytes.substr(0, 4), "\x89PNG") << name;
    EXPECT_GT(bytes.size(), kBlankPngBytes) << name;
  }
  // Red, green and blue of one pixel.
  std::array<int, 3> Pixel(const std::string& name, int x, int y) const {
    int width = 0, height = 0, channels = 0;
    unsigned char* const pixels = stbi_load(File(name).c_str(), &width, &height, &channels, 3);
    EXPECT_NE(pixels, nullptr) << name;
    if (pixels == nullptr || x >= width || y >= height) return {};
    const unsigned char* const at = pixels + 3 * (y * width + x);
    const std::array<int, 3> colour = {at[0], at[1], at[2]};
    stbi_image_free(pixels);
    return colour;
  }
  std::string Control() { return run_->cluster().control_address(); }

  host::TemporaryFolder folder_;
  VirtualDisplay display_{folder_.path()};
};

// A PNG file of one pixel, of 69 bytes: half as red as a screen can be, and a fifth as green.
constexpr char kBrown[] =
    "89504e470d0a1a0a0000000d4948445200000001000000010802000000907753de0000000c4944415478da6368306600"
    "0001ea00b4e50f52d10000000049454e44ae426082";
constexpr std::size_t kBrown_bytes = (sizeof kBrown - 1) / 2;

// A level of a floor, a place to begin, and two squares of 5 m ahead of it, left and right, which are nothing but
// sides: the left one faces the player, and is brown by its material's colour; the right one shows its back, and is
// brown by its picture. A fifth of the light is half as bright to the eye.
std::string TwoSides() {
  const std::vector<float> positions = {0, 0, 0, 5, 0, 0, 5, 5, 0, 0, 5, 0}, places = {0, 1, 1, 1, 1, 0, 0, 0};
  const std::vector<std::uint32_t> indices = {0, 1, 2, 0, 2, 3};
  std::string picture;
  for (std::size_t i = 0; i < kBrown_bytes; ++i) {
    picture += static_cast<char>(std::stoi(std::string(kBrown + 2 * i, 2), nullptr, 16));
  }
  const std::string bytes = std::to_string(kBrown_bytes);
  picture.resize((picture.size() + 3) / 4 * 4);
  const std::size_t size = 48 + 24 + 32 + picture.size();
  std::string json = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1,2,3]}],"nodes":[)"
                     R"({"name":"spawn"},{"name":"face","mesh":0,"translation":[-6,0,-6]},)"
                     R"({"name":"back","mesh":1,"translation":[6,0,-6],"rotation":[0,1,0,0]},)"
                     R"({"name":"floor","mesh":0,"translation":[-40,0,40],"rotation":[-0.70710678,0,0,0.70710678],)"
                     R"("scale":[16,16,1]}],)"
                     R"("materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.2140411,0.0331048,0,1]}},)"
                     R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],)"
                     R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]},)"
                     R"({"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":2},"indices":1,"material":1}]}],)"
                     R"("textures":[{"source":0}],"images":[{"bufferView":3,"mimeType":"image/png"}],)"
                     R"("accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":4},)"
                     R"({"bufferView":1,"componentType":5125,"type":"SCALAR","count":6},)"
                     R"({"bufferView":2,"componentType":5126,"type":"VEC2","count":4}],"bufferViews":[)"
                     R"({"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24},)"
                     R"({"buffer":0,"byteOffset":72,"byteLength":32},{"buffer":0,"byteOffset":104,"byteLength":)" +
                     bytes + R"(}],"buffers":[{"byteLength":)" + std::to_string(size) + "}]}";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string glb;
  const auto words = [&](std::initializer_list<std::size_t> values) {
    for (const std::size_t value : values) {
      for (int shift = 0; shift < 32; shift += 8) glb += static_cast<char>(value >> shift & 255);
    }
  };
  words({0x46546C67, 2, 28 + json.size() + size, json.size(), 0x4E4F534A});
  glb += json;
  words({size, 0x004E4942});
  glb.append(reinterpret_cast<const char*>(positions.data()), 48);
  glb.append(reinterpret_cast<const char*>(indices.data()), 24);
  glb.append(reinterpret_cast<const char*>(places.data()), 32);
  return glb + picture;
}

double MetricOf(const std::string& page, const std::string& series) {
  const auto at = page.find("\n" + series + " ");
  return at == std::string::npos ? std::nan("") : std::atof(page.c_str() + at + series.size() + 2);
}

constexpr double kMib = 1024.0 * 1024;

// A row of the panel's timings, by the names that the library and the metrics have for it.
struct TimingNames {
  const char *label, *figure;
};
constexpr std::array<TimingNames, 5> kTimings = {{{"physics update", "physics"},
                                                  {"prediction", "prediction"},
                                                  {"full snapshots", "snapshot_full"},
                                                  {"delta snapshots", "snapshot_delta"},
                                                  {"whole tick", "step"}}};

class DesktopProfilerTest : public DesktopTest {
 protected:
  // All that the panel shows of the client, against tessera_get_stats of the same second.
  static void ExpectClientShown(const Report& report) {
    const auto recent_ms = [&](const std::string& time) {
      const double before = report.Figure("before " + time + ".count"), now = report.Figure("now " + time + ".count");
      EXPECT_GT(now, before) << time;
      return (now * report.Figure("now " + time + ".mean") - before * report.Figure("before " + time + ".mean")) * 1e3 /
             (now - before);
    };
    report.ExpectShown("frame time", recent_ms("frame_time"));
    report.ExpectShown("frames", 1e3 / recent_ms("frame_time"));
    report.ExpectShown("network time", recent_ms("network_time"));
    report.ExpectShown("update time", recent_ms("update_time"));
    report.ExpectShown("round trip", report.Figure("now round_trip_s") * 1e3);
    report.ExpectShown("shown behind", report.Figure("now render_delay_s") * 1e3);
    report.ExpectShown("received", report.Figure("now bytes_in_per_s") / 1e3);
    report.ExpectShown("sent", report.Figure("now bytes_out_per_s") / 1e3);
    report.ExpectShown("world", report.Figure("now tick_rate_hz"));
    EXPECT_EQ(report.Shown("bodies"), report.Figure("now bodies"));
    EXPECT_GT(report.Shown("bodies"), 0);
  }
  // All that it shows of a region, against tessera_region_stats of the same second.
  static void ExpectRegionShown(const Report& report, const std::string& region) {
    for (const TimingNames& timing : kTimings) {
      const std::string label = region + timing.label, figure = region + timing.figure;
      if (report.panel.contains(label)) {
        EXPECT_GT(report.Shown(label), 0);
        report.ExpectShown(label, report.Figure(figure + ".recent") * 1e3);
      } else {
        const double count = report.Figure(figure + ".count");
        report.ExpectShown(label + " (of all)", count > 0 ? report.Figure(figure + ".total") * 1e3 / count : 0);
      }
    }
    for (const char* count : {"bodies", "ghosts", "asleep"}) {
      EXPECT_EQ(report.Shown(region + count), report.Figure(region + count)) << count;
    }
    report.ExpectShown(region + "virtual memory, MiB", report.Figure(region + "process_virtual_bytes") / kMib);
    report.ExpectShown(region + "physical memory, MiB", report.Figure(region + "process_physical_bytes") / kMib);
  }
  // Memory of the host that one region speaks of: usable, of all that there is.
  static void ExpectHostShown(const Report& report, const std::string& region) {
    for (const std::string memory : {"virtual", "physical"}) {
      const std::string label = memory + ", host", figure = region + "host_" + memory;
      report.ExpectShown(label, report.Figure(figure + "_usable_bytes") / kMib);
      const std::string& text = report.panel.at(label);
      const auto of = text.find(" of ");
      ASSERT_NE(of, std::string::npos) << text;
      const double total_mib = report.Figure(figure + "_total_bytes") / kMib;
      EXPECT_NEAR(std::atof(text.c_str() + of + 4), total_mib, kShownWithin * total_mib) << text;
    }
  }
  // All that it shows of a region, against the page of metrics of its worker, whose world stands still.
  static void ExpectPageShown(const Report& report, const std::string& region, const std::string& page) {
    for (const TimingNames& timing : kTimings) {
      const std::string family = std::string("tessera_region_") + timing.figure + "_seconds";
      const double count = MetricOf(page, family + "_count");
      const double mean_ms = count > 0 ? MetricOf(page, family + "_sum") * 1e3 / count : 0;
      report.ExpectShown(region + timing.label + " (of all)", mean_ms);
    }
    for (const auto& [label, state] : {std::pair("bodies", "owned"), {"ghosts", "ghost"}, {"asleep", "asleep"}}) {
      const double bodies = MetricOf(page, std::string("tessera_region_bodies{state=\"") + state + "\"}");
      EXPECT_EQ(report.Shown(region + label), bodies) << label;
    }
    EXPECT_EQ(report.Figure(region + "tick"), MetricOf(page, "tessera_region_tick"));
    report.ExpectShown(region + "virtual memory, MiB", MetricOf(page, "process_virtual_memory_bytes") / kMib);
    report.ExpectShown(region + "physical memory, MiB", MetricOf(page, "process_resident_memory_bytes") / kMib);
    for (const std::string memory : {"virtual", "physical"}) {
      const double total = MetricOf(page, "tessera_host_" + memory + "_memory_total_bytes");
      EXPECT_EQ(report.Figure(region + "host_" + memory + "_total_bytes"), total);
    }
  }
};

// From the menu by keys into a world of characters, who stand still unless somebody walks them.
TEST_F(DesktopProfilerTest, PlaysAndShowsWhatItCosts) {
  Start({.scene = support::ScenePath("course"), .regions = 2, .bodies = std::nullopt, .bots = 0});
  ASSERT_TRUE(PlayUntil("running", [&] { return run_->Latest().state() == v1::INSTANCE_STATE_RUNNING; }));
  const auto played =
      Client({"--control", Control()}, "wait menu\nframes 2\nscreenshot " + File("menu.png") +
                                           "\npress Return\nwait world\nwait figures\nreport " + File("before") +
                                           "\nhold W\nwait moved 2\nrelease W\nscreenshot " + File("world.png") +
                                           "\nreport " + File("after") + "\nquit\n");
  ASSERT_EQ(played.exit_code, 0) << played.err;
  ExpectPicture("menu.png");
  ExpectPicture("world.png");
  for (const char* name : {"before", "after"}) {
    SCOPED_TRACE(name);
    const Report running = ReadReport(name);
    ExpectClientShown(running);
    for (const std::string region : {"region 1 ", "region 2 "}) {
      ExpectRegionShown(running, region);
      EXPECT_TRUE(running.panel.contains(region + "whole tick")) << "of the last second, for the world runs";
    }
    ExpectHostShown(running, "region 1 ");
  }

  // A paused world's figures stand, so a panel and a page of the same second can be had.
  const std::string id = run_->Latest().id();
  ASSERT_EQ(Tessera({"instance", "pause", id, "--wait"}).exit_code, 0);
  const auto shown = Client({"--control", Control(), "--instance", id},
                            "wait world\nwait figures\nreport " + File("paused") + "\nquit\n");
  ASSERT_EQ(shown.exit_code, 0) << shown.err;
  const Report report = ReadReport("paused");
  const v1::Instance instance = run_->Latest();
  ASSERT_EQ(instance.region_status_size(), 2);
  for (const v1::RegionStatus& status : instance.region_status()) {
    const v1::RegionAddress& at = status.report().address();
    const auto page = telemetry::HttpGet(at.host() + ":" + std::to_string(at.metrics_port()), "/metrics");
    ASSERT_TRUE(page.ok()) << page.status();
    const std::string region = "region " + std::to_string(status.region()) + " ";
    ExpectRegionShown(report, region);
    ExpectPageShown(report, region, page->body);
  }
}

TEST_F(DesktopTest, DrawsTheMeshesOfAnImportedLevelInTheirColoursAndPicturesFromBothSides) {
  std::ofstream(File("sides.glb"), std::ios::binary) << TwoSides();
  const auto imported = support::RunProgram("tessera", {"scene", "import", File("sides.glb"), File("sides.json")});
  ASSERT_EQ(imported.exit_code, 0) << imported.err;
  Start({.scene = File("sides.json"), .regions = 1, .bodies = std::nullopt, .bots = 0, .page_listen = "127.0.0.1:0"});
  ASSERT_TRUE(PlayUntil("running", [&] { return run_->Latest().state() == v1::INSTANCE_STATE_RUNNING; }));
  // Out of the folder, and by the gateway, which has them from the control plane.
  const std::vector<std::string> folder{"--visuals", File("visuals")}, page{"--page", run_->cluster().page_url()};
  for (const std::vector<std::string>& places : {folder, page}) {
    SCOPED_TRACE(places[0]);
    std::vector<std::string> arguments{"--control", Control(), "--instance", run_->Latest().id()};
    arguments.insert(arguments.end(), places.begin(), places.end());
    const auto played = Client(arguments, "wait world\nwait meshes\npress Tab\nwait rest\nframes 2\nscreenshot " +
                                              File("sides.png") + "\nquit\n");
    ASSERT_EQ(played.exit_code, 0) << played.err;
    EXPECT_EQ(played.err, "");
    // Seven tenths of the light of the sky and a low sun, of half of what a screen has.
    const std::array<int, 3> face = Pixel("sides.png", 240, 150), back = Pixel("sides.png", 400, 150);
    EXPECT_NEAR(face[0], 90, 12);
    EXPECT_NEAR(face[1], 36, 12);
    EXPECT_LT(face[2], 12);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(back[i], face[i], 8) << "channel " << i;
  }
}

TEST_F(DesktopTest, ShowsWhoIsAwaited) {
  Start({.scene = support::ScenePath("course"), .regions = 1, .bodies = std::nullopt, .bots = 0, .capacity = 4});
  const auto created = Tessera({"instance", "create", "--scene", support::ScenePath("minimal"), "--regions", "1",
                                "--players", "2", "--start-deadline", "600"});
  ASSERT_EQ(created.exit_code, 0) << created.err;
  // "instance/inst-2 created, ..."
  const std::string id =
      created.out.substr(created.out.find('/') + 1, created.out.find(' ') - created.out.find('/') - 1);
  const auto waited = Client(
      {"--control", Control(), "--instance", id, "--name", "ada"},
      "wait waiting\nwait listed\nscreenshot " + File("waiting.png") + "\nreport " + File("waiting") + "\nquit\n");
  EXPECT_EQ(waited.exit_code, 0) << waited.err;
  ExpectPicture("waiting.png");
  const std::string report = host::ReadFile(File("waiting"), std::size_t{1} << 20).value_or("");
  EXPECT_NE(report.find("players 1 of 2: ada"), std::string::npos) << report;
}

TEST_F(DesktopTest, PlaysByATicketWhereNoGuestsAreTaken) {
  Start({.scene = support::ScenePath("course"), .regions = 1, .bodies = std::nullopt, .bots = 0, .capacity = 4});
  const auto created = Tessera(
      {"instance", "create", "--scene", support::ScenePath("course"), "--regions", "1", "--guests", "off", "--wait"});
  ASSERT_EQ(created.exit_code, 0) << created.err;
  ASSERT_EQ(Tessera({"issuer", "create", "game", "--key-out", File("game.key")}).exit_code, 0);
  const auto signed_ticket = Tessera({"ticket", "sign", "--key", File("game.key"), "--player", "ada", "--name", "Ada"});
  ASSERT_EQ(signed_ticket.exit_code, 0) << signed_ticket.err;
  std::ofstream(File("ada.ticket")) << signed_ticket.out;
  const std::vector<std::string> there{"--control", Control(), "--instance", "inst-2"};
  const auto guest = Client(there, "wait trouble\nquit\n");
  EXPECT_EQ(guest.exit_code, 3);
  EXPECT_NE(guest.err.find("this instance takes no guests: a ticket is needed"), std::string::npos) << guest.err;
  std::vector<std::string> with_ticket = there;
  with_ticket.insert(with_ticket.end(), {"--ticket", File("ada.ticket")});
  const auto ada = Client(with_ticket, "wait world\nquit\n");
  EXPECT_EQ(ada.exit_code, 0) << ada.err;
  const auto again = Client(with_ticket, "wait trouble\nquit\n");
  EXPECT_EQ(again.exit_code, 3);
  EXPECT_NE(again.err.find("ticket: "), std::string::npos) << "it is good for one try: " << again.err;
}

TEST_F(DesktopTest, SaysWhatIsWrong) {
  const auto nobody =
      Client({"--control", "unix:/nowhere/control.sock"},
             "wait trouble\nframes 2\nscreenshot " + File("nobody.png") + "\nreport " + File("nobody") + "\nquit\n");
  EXPECT_EQ(nobody.exit_code, 3);
  EXPECT_NE(nobody.err.find("control plane at unix:/nowhere/control.sock"), std::string::npos) << nobody.err;
  ExpectPicture("nobody.png");
  // The screen shows the same text.
  const std::string report = host::ReadFile(File("nobody"), std::size_t{1} << 20).value_or("");
  EXPECT_NE(report.find("screen menu\ntrouble control plane at unix:/nowhere/control.sock"), std::string::npos)
      << report;
  const auto no_step = Client({}, "dance\n");
  EXPECT_EQ(no_step.exit_code, 2);
  EXPECT_NE(no_step.err.find("no step 'dance'"), std::string::npos) << no_step.err;
  EXPECT_EQ(support::RunProgram("tessera-desktop", {"--colour"}).exit_code, 2);
  setenv("DISPLAY", ":59999", 1);
  const auto blind = support::RunProgram("tessera-desktop", {"--frames", "1"});
  EXPECT_EQ(blind.exit_code, 1);
  EXPECT_NE(blind.err.find("no window"), std::string::npos) << blind.err;
}

}  // namespace
}  // namespace tessera::end_to_end
