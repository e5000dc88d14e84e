#include "bench/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "cli/table.h"

namespace tessera::bench {
namespace {

void AddUnique(std::vector<std::string>& list, const std::string& item) {
  if (std::find(list.begin(), list.end(), item) == list.end()) list.push_back(item);
}

// As RFC 4180 has it.
std::string CsvField(const std::string& text) { return text.find(',') == std::string::npos ? text : '"' + text + '"'; }

}  // namespace

void Report::Add(const std::string& scene, const std::string& engine, const std::string& config,
                 const std::string& metric, double value, const std::string& unit) {
  figures_.push_back({suite_, scene, engine, config, metric, value, unit});
}

void Report::Set(const std::string& scene, const std::string& engine, const std::string& config,
                 const std::string& metric, double value, const std::string& unit) {
  const auto known = std::find_if(figures_.begin(), figures_.end(), [&](const Figure& f) {
    return f.scene == scene && f.engine == engine && f.config == config && f.metric == metric;
  });
  if (known == figures_.end()) return Add(scene, engine, config, metric, value, unit);
  known->value = value;
  known->unit = unit;
}

std::string Report::Table() const {
  std::vector<std::string> scenes;
  for (const Figure& figure : figures_) AddUnique(scenes, figure.scene);
  std::string out;
  for (const std::string& scene : scenes) {
    std::vector<std::string> engines, configs, metrics;
    for (const Figure& figure : figures_) {
      if (figure.scene == scene) AddUnique(engines, figure.engine);
    }
    const auto column_of = [&](const Figure& figure) {
      return engines.size() > 1 ? figure.engine + " " + figure.config : figure.config;
    };
    for (const Figure& figure : figures_) {
      if (figure.scene != scene) continue;
      AddUnique(configs, column_of(figure));
      AddUnique(metrics, figure.metric);
    }
    std::vector<cli::TableRow> rows{{"METRIC"}};
    rows[0].insert(rows[0].end(), configs.begin(), configs.end());
    for (const std::string& metric : metrics) {
      cli::TableRow row{metric};
      for (const std::string& config : configs) {
        const auto figure = std::find_if(figures_.begin(), figures_.end(), [&](const Figure& f) {
          return f.scene == scene && column_of(f) == config && f.metric == metric;
        });
        row.push_back(figure == figures_.end() ? "-" : Human(figure->value, figure->unit));
      }
      rows.push_back(row);
    }
    out += fmt::format("\n{} / {}\n{}", suite_, scene, cli::FormatTable(rows));
  }
  return out;
}

absl::Status Report::WriteCsv(const std::string& path) const {
  std::ofstream out(path, std::ios::trunc);
  out << "suite,scene,engine,config,metric,value,unit\n";
  for (const Figure& f : figures_) {
    out << fmt::format("{},{},{},{},{},{:.9g},{}\n", f.suite, CsvField(f.scene), f.engine, CsvField(f.config), f.metric,
                       f.value, f.unit);
  }
  out.close();
  if (!out) return absl::PermissionDeniedError(fmt::format("--csv {}: cannot be written", path));
  return absl::OkStatus();
}

std::string Human(double value, const std::string& unit) {
  if (!std::isfinite(value)) return "-";
  if (unit == "s") {
    if (value < 1e-3) return fmt::format("{:.3g}us", value * 1e6);
    if (value < 1) return fmt::format("{:.3g}ms", value * 1e3);
    return fmt::format("{:.3g}s", value);
  }
  if (unit == "bytes") return cli::FormatBytes(value);
  if (unit == "1") return fmt::format("{:.6g}", value);
  return fmt::format("{:.4g}{}", value, unit);
}

}  // namespace tessera::bench
