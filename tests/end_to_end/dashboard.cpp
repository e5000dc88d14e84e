#include "tests/end_to_end/dashboard.h"

#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <stdexcept>

#include "host/files.h"

namespace tessera::end_to_end {
namespace {

constexpr std::size_t kMaxSourceBytes = 1 << 24;

void ReplaceAll(std::string& text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
}

std::string WithoutVariables(std::string expression, const std::string& window) {
  ReplaceAll(expression, "$__rate_interval", window);
  ReplaceAll(expression, "$instance_id", ".*");
  ReplaceAll(expression, "$region", ".*");
  return expression;
}

// label_values(metric{...}, label) is Grafana's own; this PromQL has a result exactly if it has one.
std::string AsPromql(const std::string& variable_query) {
  static const std::regex form(R"(label_values\((.*), *(\w+)\))");
  std::smatch part;
  if (!std::regex_match(variable_query, part, form)) throw std::runtime_error("not label_values: " + variable_query);
  return "count by (" + part[2].str() + ") (" + part[1].str() + ")";
}

}  // namespace

std::string ReadSource(const std::string& path) {
  auto text = host::ReadFile(std::string(TESSERA_SOURCE_DIR) + "/" + path, kMaxSourceBytes);
  if (!text.ok()) throw std::runtime_error(text.status().ToString());
  return *std::move(text);
}

std::vector<DashboardQuery> DashboardQueries(const std::string& window) {
  const auto dashboard = nlohmann::json::parse(ReadSource("deploy/grafana/dashboards/tessera.json"));
  std::vector<DashboardQuery> queries;
  for (const auto& variable : dashboard.at("templating").at("list")) {
    if (variable.at("type") != "query") continue;
    queries.push_back({.panel = "variable " + variable.at("name").get<std::string>(),
                       .expression = WithoutVariables(AsPromql(variable.at("definition")), window)});
  }
  for (const auto& panel : dashboard.at("panels")) {
    if (panel.at("type") == "row") continue;
    for (const auto& target : panel.at("targets")) {
      queries.push_back({.panel = panel.at("title"), .expression = WithoutVariables(target.at("expr"), window)});
    }
  }
  return queries;
}

std::vector<DashboardQuery> DashboardMarks() {
  const auto dashboard = nlohmann::json::parse(ReadSource("deploy/grafana/dashboards/tessera.json"));
  std::vector<DashboardQuery> marks;
  for (const auto& mark : dashboard.at("annotations").at("list")) {
    marks.push_back({.panel = mark.at("name"), .expression = WithoutVariables(mark.at("expr"), "")});
  }
  return marks;
}

std::set<MetricInfo> ListedMetrics() {
  static const std::regex row(R"(^\| `((?:tessera|process)_\w+)(\{[^`]*\})?` \| (\w+) \|)");
  std::set<MetricInfo> metrics;
  std::istringstream page(ReadSource("docs/metrics.md"));
  for (std::string line; std::getline(page, line);) {
    std::smatch part;
    if (std::regex_search(line, part, row)) metrics.insert({.name = part[1], .type = part[3]});
  }
  return metrics;
}

std::set<std::string> MetricNamesIn(const std::string& text) {
  static const std::regex word(R"(\b(?:tessera|process)_\w+)");
  std::set<std::string> names;
  for (std::sregex_iterator it(text.begin(), text.end(), word), end; it != end; ++it) names.insert(it->str());
  return names;
}

bool HasLabelsOfAGame(const std::string& metric) {
  return metric.starts_with("tessera_game_counter_") || metric.starts_with("tessera_game_callback_");
}

}  // namespace tessera::end_to_end
