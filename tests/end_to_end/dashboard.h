// Queries of deploy/ and metrics that docs/metrics.md promises, read from the files themselves.
#pragma once

#include <set>
#include <string>
#include <vector>

namespace tessera::end_to_end {

struct DashboardQuery {
  std::string panel;
  std::string expression;  // PromQL, with Grafana's variables replaced: all instances, all regions, rates over `window`
};

// All queries of deploy/grafana/dashboards/tessera.json, those of its variables among them.
std::vector<DashboardQuery> DashboardQueries(const std::string& window);

struct MetricInfo {
  std::string name;
  std::string type;  // "gauge", "counter", "histogram"
  auto operator<=>(const MetricInfo&) const = default;
};

// The queries whose results are marked on all graphs, with "$instance_id" replaced by what matches all.
std::vector<DashboardQuery> DashboardMarks();

// The tables of docs/metrics.md.
std::set<MetricInfo> ListedMetrics();

// Every word in `text` that begins with tessera_ or process_ .
std::set<std::string> MetricNamesIn(const std::string& text);

// Metrics whose labels a game gives: a world without one has no series of them.
bool HasLabelsOfAGame(const std::string& metric);

// A file of this repository.
std::string ReadSource(const std::string& path);

}  // namespace tessera::end_to_end
