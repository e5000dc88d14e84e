#include "screens.h"

#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "world.h"

namespace desktop {
namespace {

const ImVec4 kTrouble = {1.0F, 0.55F, 0.45F, 1}, kFaint = {0.66F, 0.71F, 0.78F, 1}, kStrong = {1.0F, 0.84F, 0.36F, 1};
constexpr char kThisMachine[] = "this machine";
constexpr char kFont[] = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
constexpr ImGuiWindowFlags kPanel = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                                    ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                                    ImGuiWindowFlags_AlwaysAutoResize;

// In the middle of the window, `width` wide.
void BeginCentred(const char* name, float width) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({size.x / 2, size.y / 2}, ImGuiCond_Always, {0.5F, 0.5F});
  ImGui::SetNextWindowSizeConstraints({width, 0}, {width, 0.9F * size.y});
  ImGui::Begin(name, nullptr, kPanel);
}

void Headline(const char* text, const char* below) {
  ImGui::SetWindowFontScale(1.7F);
  ImGui::TextUnformatted(text);
  ImGui::SetWindowFontScale(1);
  ImGui::TextColored(kFaint, "%s", below);
  ImGui::Spacing();
  ImGui::Separator();
  ImGui::Spacing();
}

void Wrapped(ImVec4 colour, const std::string& text) {
  ImGui::PushStyleColor(ImGuiCol_Text, colour);
  ImGui::TextWrapped("%s", text.c_str());
  ImGui::PopStyleColor();
}

const char* NameOf(tessera_instance_state state) {
  switch (state) {
    case TESSERA_INSTANCE_WAITING:
      return "waiting for players";
    case TESSERA_INSTANCE_RUNNING:
      return "running";
    case TESSERA_INSTANCE_PAUSED:
      return "paused";
    default:
      return state < TESSERA_INSTANCE_WAITING ? "starting" : "running, degraded";
  }
}

void ShowWorlds(MenuState& menu) {
  const float line = ImGui::GetTextLineHeightWithSpacing();
  const auto rows = static_cast<float>(std::clamp<std::size_t>(menu.worlds.size() + 1, 4, 10));
  constexpr ImGuiTableFlags kFlags = ImGuiTableFlags_SizingStretchProp | ImGuiTableFlags_RowBg |
                                     ImGuiTableFlags_BordersOuter | ImGuiTableFlags_ScrollY;
  if (!ImGui::BeginTable("worlds", 5, kFlags, {0, (rows + 0.6F) * line})) return;
  for (const char* column : {"world", "scene", "state", "regions", "players"}) ImGui::TableSetupColumn(column);
  ImGui::TableHeadersRow();
  for (std::size_t i = 0; i < menu.worlds.size(); ++i) {
    const tessera::InstanceInfo& world = menu.worlds[i];
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    if (ImGui::Selectable(world.id, i == menu.chosen, ImGuiSelectableFlags_SpanAllColumns)) menu.chosen = i;
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(world.scene);
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(NameOf(world.state));
    ImGui::TableNextColumn();
    ImGui::Text("%u", world.regions);
    ImGui::TableNextColumn();
    if (world.expected_players > 0) {
      ImGui::Text("%u of %u", world.players, world.expected_players);
    } else {
      ImGui::Text("%u", world.players);
    }
  }
  ImGui::EndTable();
}

void Faint(const std::string& text) { ImGui::TextColored(kFaint, "%s", text.c_str()); }

void ShowBar(const Panel::Bar& bar) {
  ImGui::AlignTextToFramePadding();
  Faint(bar.label);
  ImGui::SameLine(0.42F * ImGui::GetWindowWidth());
  ImGui::ProgressBar(static_cast<float>(bar.share), {-1, 0}, bar.text.c_str());
}

void ShowCells(const Panel::Row& row) {
  ImGui::TableNextColumn();
  Faint(row.label);
  for (const Panel::Cell& cell : row.cells) {
    ImGui::TableNextColumn();
    if (cell.of_all) {
      ImGui::TextDisabled("%s", cell.text.c_str());
    } else {
      ImGui::TextUnformatted(cell.text.c_str());
    }
  }
}

void ShowRegions(const Panel& panel) {
  const int columns = static_cast<int>(panel.columns.size()) + 1;
  if (!ImGui::BeginTable("regions", columns, ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_RowBg)) return;
  ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, 12.5F * ImGui::GetFontSize());
  for (int i = 1; i < columns; ++i)
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, 3.6F * ImGui::GetFontSize());
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  ImGui::TextUnformatted("region, ms a time");
  for (const Panel::Column& column : panel.columns) {
    const Vec3 c = ColourOf(column.region);
    ImGui::TableNextColumn();
    ImGui::TextColored({0.3F + 0.7F * c.x, 0.3F + 0.7F * c.y, 0.3F + 0.7F * c.z, 1}, column.connected ? "%u" : "%u ?",
                       column.region);
  }
  for (const Panel::Row& row : panel.regions) {
    ImGui::TableNextRow();
    ShowCells(row);
  }
  ImGui::EndTable();
  if (panel.more > 0) ImGui::TextColored(kFaint, "and %zu more", panel.more);
}

}  // namespace

bool CanBeJoined(const tessera::InstanceInfo& world) {
  return world.state <= TESSERA_INSTANCE_RUNNING + 1 || world.state == TESSERA_INSTANCE_PAUSED;
}

void SetStyle(float scale) {
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;
  std::error_code error;
  if (std::filesystem::exists(kFont, error)) io.Fonts->AddFontFromFileTTF(kFont, 15 * scale);
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 8;
  style.FrameRounding = 4;
  style.WindowPadding = {16, 14};
  style.FramePadding = {9, 5};
  style.ItemSpacing = {9, 6};
  style.CellPadding = {7, 2};
  style.WindowBorderSize = 0;
  style.Colors[ImGuiCol_WindowBg] = {0.07F, 0.09F, 0.13F, 0.86F};
  style.Colors[ImGuiCol_FrameBg] = {0.17F, 0.21F, 0.28F, 1};
  style.Colors[ImGuiCol_Button] = {0.19F, 0.42F, 0.72F, 1};
  style.Colors[ImGuiCol_ButtonHovered] = {0.26F, 0.52F, 0.86F, 1};
  style.Colors[ImGuiCol_Header] = {0.19F, 0.42F, 0.72F, 0.7F};
  style.Colors[ImGuiCol_TableHeaderBg] = {0.13F, 0.16F, 0.22F, 1};
  style.Colors[ImGuiCol_TableRowBgAlt] = {1, 1, 1, 0.03F};
  style.Colors[ImGuiCol_PlotHistogram] = {0.25F, 0.50F, 0.62F, 1};
  style.ScaleAllSizes(scale);
}

MenuChoice ShowMenu(MenuState& menu) {
  MenuChoice choice = MenuChoice::kNone;
  BeginCentred("menu", 620);
  Headline("Tessera", "One world, many machines");
  ImGui::PushItemWidth(-1);
  ImGui::TextColored(kFaint, "Control plane");
  if (ImGui::InputTextWithHint("##address", kThisMachine, &menu.address, ImGuiInputTextFlags_EnterReturnsTrue)) {
    choice = MenuChoice::kRefresh;
  }
  ImGui::TextColored(kFaint, "Your name");
  // A ticket says the name itself.
  ImGui::BeginDisabled(!menu.ticket.empty());
  ImGui::InputText("##name", &menu.player_name);
  ImGui::EndDisabled();
  ImGui::TextColored(kFaint, "Ticket, where a world takes no guests");
  ImGui::InputTextWithHint("##ticket", "none: as a guest", &menu.ticket, ImGuiInputTextFlags_Password);
  ImGui::PopItemWidth();
  ImGui::Spacing();
  ShowWorlds(menu);
  if (!menu.trouble.empty()) {
    Wrapped(kTrouble, menu.trouble);
  } else if (!menu.listed) {
    Wrapped(kFaint,
            "Asking " + (menu.address.empty() ? std::string(kThisMachine) : menu.address) + " for its worlds ...");
  } else if (menu.worlds.empty()) {
    Wrapped(kFaint, "No world runs there. Start one: tessera instance create --scene plaza --regions 4");
  }
  ImGui::Spacing();
  const bool none = menu.chosen >= menu.worlds.size();
  ImGui::BeginDisabled(none);
  if (ImGui::Button("Join", {120, 0})) choice = MenuChoice::kJoin;
  ImGui::EndDisabled();
  ImGui::SameLine();
  if (ImGui::Button("Refresh", {120, 0})) choice = MenuChoice::kRefresh;
  ImGui::SameLine();
  ImGui::AlignTextToFramePadding();
  ImGui::TextColored(kFaint, "up, down: choose    enter: join    F5: refresh");
  ImGui::End();
  return choice;
}

bool ShowWaiting(Screen screen, const std::string& instance, const tessera::InstanceInfo* world) {
  BeginCentred("waiting", 460);
  Headline(screen == Screen::kJoining ? "Joining" : "Waiting for players", instance.c_str());
  if (screen == Screen::kJoining) ImGui::TextColored(kFaint, "Connecting to the world's regions ...");
  if (world != nullptr && screen == Screen::kWaiting) {
    ImGui::Text("%u of %u are in", world->players, std::max(world->expected_players, world->players));
    ImGui::Spacing();
    for (std::uint32_t i = 0; i < world->name_count; ++i) ImGui::BulletText("%s", world->player_names[i]);
    if (world->players > world->name_count) ImGui::BulletText("and %u more", world->players - world->name_count);
    for (std::uint32_t i = world->players; i < std::min(world->expected_players, world->players + 8); ++i) {
      ImGui::Bullet();
      ImGui::TextColored(kFaint, "awaited");
    }
    ImGui::Spacing();
    ImGui::TextColored(kFaint, "scene %s, %u regions", world->scene, world->regions);
  } else if (screen == Screen::kWaiting) {
    ImGui::TextColored(kFaint, "The world starts when all expected players are in.");
  }
  ImGui::Spacing();
  const bool back = ImGui::Button("Back", {120, 0});
  ImGui::End();
  return back;
}

void ShowProfiler(const Panel& panel) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({size.x - 12, 12}, ImGuiCond_Always, {1, 0});
  ImGui::Begin("profiler", nullptr, kPanel | ImGuiWindowFlags_NoInputs);
  if (ImGui::BeginTable("client", 4, ImGuiTableFlags_SizingFixedFit)) {
    const float label = 7.2F * ImGui::GetFontSize(), number = 6.2F * ImGui::GetFontSize();
    for (const float width : {label, number, label, number}) {
      ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, width);
    }
    for (const Panel::Row& row : panel.client) ShowCells(row);
    ImGui::EndTable();
  }
  ImGui::Separator();
  ShowRegions(panel);
  if (!panel.host.empty()) ImGui::Separator();
  for (const Panel::Bar& bar : panel.host) ShowBar(bar);
  ImGui::End();
}

void ShowHud(const tessera::SceneInfo& scene, const std::string& instance, bool spectating, bool paused,
             const std::string& notice) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({12, 12}, ImGuiCond_Always);
  ImGui::Begin("place", nullptr, kPanel | ImGuiWindowFlags_NoInputs);
  ImGui::Text("%s", scene.name);
  ImGui::TextColored(kFaint, "%s", instance.c_str());
  if (paused) ImGui::TextColored(kStrong, "The world is paused");
  if (spectating) ImGui::TextColored(kStrong, "You are watching");
  if (!notice.empty()) Wrapped(kTrouble, notice);
  ImGui::End();
  ImGui::SetNextWindowPos({size.x / 2, size.y - 12}, ImGuiCond_Always, {0.5F, 1});
  ImGui::Begin("keys", nullptr, kPanel | ImGuiWindowFlags_NoInputs);
  const bool walks = scene.character_walk_speed_m_s > 0;
  ImGui::TextColored(
      kFaint, "%s",
      walks
          ? "W A S D: walk    space: jump    shift: run    mouse: look    wheel: distance    tab: profiler    esc: menu"
          : "W A S D: push    mouse, arrows: look    wheel: distance    tab: profiler    esc: menu");
  ImGui::End();
}

bool ShowEnd(const std::string& instance, const std::string& why) {
  BeginCentred("end", 460);
  Headline("The world has ended", instance.c_str());
  Wrapped(why.empty() ? kFaint : kTrouble, why.empty() ? "It ended in order." : why);
  ImGui::Spacing();
  const bool back = ImGui::Button("Back", {120, 0});
  ImGui::End();
  return back;
}

}  // namespace desktop
